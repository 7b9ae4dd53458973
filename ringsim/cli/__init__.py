"""The command line: verbs only, each in its own file and loaded only when it is called."""

import importlib
import logging
import os
import sys
from typing import Any, TextIO

import click
from click.shell_completion import CompletionItem

from ringsim.refusal import (
    EXIT_BAD_INPUT,
    EXIT_DONE,
    EXIT_INTERRUPTED,
    InputError,
    NotBuiltError,
    known_or_nearest,
)

VERBS = {
    "scenes": "List the built-in scenes.",
    "check": "Check a scene file and summarise its model.",
    "run": "Run one scene.",
    "plot": "Draw the figures of a run or a campaign from its file.",
    "export": "Write results as tables, for MATLAB or for ParaView.",
    "explain": "Explain variables of results, keys of files and words of tables.",
    "campaign": "Run a campaign, or finish an interrupted one.",
    "status": "Show the progress of a campaign.",
    "merge": "Write the results of a campaign so far to one file.",
    "analyse": "Analyse a campaign: requirements, statistics with intervals, errors.",
    "report": "Write one HTML page about a campaign: outcomes, figures, failures, model.",
    "dossier": "List what a campaign shows of the clauses that a review asks for.",
    "compare": "Compare two campaigns, or two runs.",
    "replay": "Run one sample of a campaign again.",
    "calibrate": "Find unknown inputs from measured data.",
    "sensors": "Tell before a test how much each sensor would tell.",
    "optimise": "Find the values that make an antenna best under what is uncertain.",
    "modes": "Natural frequencies and shapes of a ring along its opening.",
    "stability": "Map which settings the solver can run, and how other runs end.",
    "accuracy": "Compare numerical settings of a scene: error against run time.",
}
"""Verb and its line of help; its command is ``VERB_command`` in the file of ``_FILES``."""
_FILES = {
    "scene": ("scenes", "check", "explain"),
    "run": ("run",),
    "studies": ("modes", "accuracy", "stability", "calibrate", "sensors", "optimise"),
    "campaign": ("campaign", "status", "replay"),
    "results": ("merge", "analyse", "report", "dossier", "plot", "compare", "export"),
}
"""Files of ``ringsim.cli`` and their verbs: only that of the verb which is called is imported."""


def command_of(verb: str) -> click.Command:
    """The command of a verb, whose file is imported by this."""
    file = next(file for file, verbs in _FILES.items() if verb in verbs)
    found = getattr(importlib.import_module(f"ringsim.cli.{file}"), f"{verb}_command")
    assert isinstance(found, click.Command)
    return found


class _Verbs(click.Group):
    def list_commands(self, ctx: click.Context) -> list[str]:
        """Verbs in the order of a user's work."""
        return list(VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the verb's file; InputError if there is no such verb."""
        if cmd_name not in VERBS:
            if ctx.resilient_parsing:  # a shell completes what is being typed
                return None
            hint = known_or_nearest(cmd_name, VERBS)
            raise InputError(f"ringsim {cmd_name}: there is no such verb ({hint})")
        return command_of(cmd_name)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Verbs, without importing any of them."""
        found = [CompletionItem(v, help=h) for v, h in VERBS.items() if v.startswith(incomplete)]
        return found or click.Command.shell_complete(self, ctx, incomplete)

    def invoke(self, ctx: click.Context) -> Any:
        """Turn refused input into one line and its exit code."""
        try:
            return super().invoke(ctx)
        except (InputError, NotBuiltError) as error:
            click.echo(str(error), err=True)
            ctx.exit(EXIT_BAD_INPUT)
        except RuntimeError as error:
            # Series are read where they are used: what is damaged in them shows there.
            if not str(error).startswith("NetCDF: "):
                raise
            told = "a netCDF file cannot be read to its end"
            cure = "it is damaged: merge the campaign, or run the scene, again"
            click.echo(f"ringsim: {told}: {error.args[0]}: {cure}", err=True)
            ctx.exit(EXIT_BAD_INPUT)
        except UnicodeEncodeError as error:
            if sys.getfilesystemencoding() == "utf-8":
                raise
            # netCDF4 takes names of files as text, and this process cannot write them as such.
            told = error.object.encode("ascii", "replace").decode("ascii")
            click.echo(
                f"{told}: a file or folder has a name that this locale "
                f"({sys.getfilesystemencoding()}) cannot represent: set PYTHONUTF8=1, or rename "
                "it",
                err=True,
            )
            ctx.exit(EXIT_BAD_INPUT)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the verbs without importing any of them."""
        with formatter.section("Verbs"):
            formatter.write_dl(list(VERBS.items()))


@click.group(cls=_Verbs, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="ringsim")
def cli() -> None:
    """How large deployable ring antennas open: simulations and campaigns.

    Exit codes: 0 done, 2 bad input, 3 the simulation failed or too many samples did,
    4 a requirement not met (analyse --gate), 130 interrupted (run again to resume).
    """
    logging.basicConfig(format="%(message)s")


class _Told:
    """Standard output or error whose reader may stop reading (``ringsim run ... | head``), or which
    is closed or full: what a verb was called for is done all the same.
    """

    def __init__(self, stream: TextIO | None) -> None:
        # A descriptor of its own: that of a closed standard output may be any file's by now.
        self._stream = open(os.devnull, "w") if stream is None else stream  # noqa: SIM115
        self.lost = ""
        """Why what was said could not be written; empty if it was, or if nobody reads."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def write(self, text: str) -> int:
        """Write, to nowhere once nobody reads."""
        try:
            return self._stream.write(text)
        except OSError as error:
            self._go_nowhere(error)
            return len(text)

    def flush(self) -> None:
        """Hand over what is written."""
        try:
            self._stream.flush()
        except OSError as error:
            self._go_nowhere(error)

    def _go_nowhere(self, error: OSError) -> None:
        if not isinstance(error, BrokenPipeError):
            self.lost = error.strerror or str(error)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)


def main() -> None:
    """The command ``ringsim``, see ``ringsim.__main__``."""
    sys.stdout, sys.stderr = out, _ = _Told(sys.stdout), _Told(sys.stderr)
    try:
        code = cli(standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        code = EXIT_BAD_INPUT
    except click.ClickException as error:
        if isinstance(error, click.NoSuchOption) and error.possibilities and error.ctx:
            shown = {
                name
                for each in error.ctx.command.get_params(error.ctx)
                if not getattr(each, "hidden", False)
                for name in each.opts
            }
            near = [each for each in error.possibilities if each in shown]
            error = click.NoSuchOption(error.option_name, possibilities=near, ctx=error.ctx)
        command = getattr(getattr(error, "ctx", None), "command_path", "ringsim")
        message = error.format_message().replace("integer range", "whole number")
        message = message.replace("integer", "whole number").replace("float range", "number")
        click.echo(f"{command}: {message} (see {command} --help)", err=True)
        code = EXIT_BAD_INPUT
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted", err=True)
        code = EXIT_INTERRUPTED
    out.flush()
    if out.lost:
        click.echo(f"standard output cannot be written: {out.lost}", err=True)
        code = code or EXIT_BAD_INPUT
    sys.exit(code or EXIT_DONE)
