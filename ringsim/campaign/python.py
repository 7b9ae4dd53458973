"""Campaigns from Python: the tables of a campaign file as arguments, the same way from there."""

import os
import pickle
import subprocess
import sys
import tomllib
import uuid
from collections.abc import Mapping
from concurrent.futures import BrokenExecutor, Executor, Future, wait
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import xarray as xr

from ringsim.analysis.design import open_stored
from ringsim.analysis.engines import too_far
from ringsim.campaign.folder import open_folder
from ringsim.campaign.merging import is_behind, merge
from ringsim.campaign.plan import plan
from ringsim.campaign.run import Choices, Order, Share, require_no_launcher, run_campaign, start
from ringsim.campaign.specification import campaign_of, load_campaign
from ringsim.choice import kind_of
from ringsim.execution.child import end_with
from ringsim.execution.mpi import launched_size
from ringsim.execution.slot import Local, without_mpi
from ringsim.files import MERGED
from ringsim.overrides import flat
from ringsim.refusal import EXIT_BAD_INPUT, EXIT_DONE, EXIT_FAILED, EXIT_INTERRUPTED, InputError
from ringsim.sampling.distributions import label_of
from ringsim.scene import Scene
from ringsim.units import Model

IN_MEMORY = 200e6
"""Bytes of a merged file up to which ``open_campaign`` reads all of it at once."""
_NAME = "ringsim.Campaign"
"""How refusals of arguments begin, as those of files with the file's name."""


class CampaignError(RuntimeError):
    """A campaign that did not give what it is to give: too many samples failed, or its engines
    differ by more than it allows.  What was computed is in its folder.
    """


class Campaign:
    """A campaign; ``run`` runs it, or finishes it.

    Parameters
    ----------
    scene
        A scene, the name of a built-in one, or a scene file.
    inputs
        Distributions by scene path, as tables of a campaign file: ``{"loads.force": {"kind":
        "uniform", "low": 0.01, "high": 0.02}}``; lengths in m, angles in degree.
    design
        How samples are placed: ``{"kind": "sobol", "samples": 64}``.
    seed
        Decides all draws: the same seed gives the same samples.
    name
        Of the folder that ``run`` writes, by default runs/NAME.
    keys
        Any other key of a campaign file (``set``, ``fidelity``, ``limits``, ``requirements``, ...):
        tables are dicts, paths of files relative to the present folder.

    Raises
    ------
    InputError
        Naming key, value, bound and cure, if something is refused.

    Examples
    --------
    >>> force = {"kind": "uniform", "low": 0.01, "high": 0.02}
    >>> Campaign("truss2", {"loads.force": force}, {"kind": "sobol"})
    Traceback (most recent call last):
    ringsim.refusal.InputError: ringsim.Campaign: design.samples is missing: give it a value
    """

    def __init__(
        self, scene: Scene | str | Path, inputs: Mapping[str, Any] | None = None,
        design: Mapping[str, Any] | Model | None = None, seed: int = 0, *,
        name: str = "campaign", **keys: Any,
    ) -> None:  # fmt: skip
        given = scene if isinstance(scene, Scene) else None
        table = {"name": name, "seed": seed, "inputs": inputs, "design": design} | keys
        text = campaign_text(scene, table)
        self._described = campaign_of(text, Path(_NAME), scene=given)

    def __repr__(self) -> str:
        """Name, design, scene and inputs, in one line."""
        asked = self._described.specification
        design = ", ".join(f"{k} {v}" for k, v in asked.design.model_dump().items() if k != "kind")
        inputs = ", ".join(asked.inputs) or "none"
        return (
            f"Campaign({asked.name!r}: scene {self._described.scene.name}; design "
            f"{kind_of(asked.design)}, {design}; inputs {inputs})"
        )

    def _repr_html_(self) -> str:
        """The same, then a row an input, and the whole file folded."""
        described = self._described
        given = flat(tomllib.loads(described.text).get("inputs", {}), "kind")
        rows = "".join(
            f"<tr><td><code>{escape(path)}</code></td><td>{escape(label_of(law))}</td></tr>"
            for path, law in given.items()
        )
        whole = f"<pre>{escape(described.text)}</pre>"
        return (
            f"<p>{escape(repr(self))}</p><table>{rows}</table>"
            f"<details><summary>as a file</summary>{whole}</details>"
        )

    @classmethod
    def read(
        cls, file: str | Path, settings: Mapping[str, Any] | None = None, samples: int | None = None
    ) -> "Campaign":
        """The campaign of a file, as ``ringsim campaign FILE --set ... --samples ...`` reads it.

        Parameters
        ----------
        file
            The campaign file; paths in it are relative to its folder.
        settings
            Values by scene path, which come after those of ``[set]``.
        samples
            Another number of samples than the file's.

        InputError if it is refused.
        """
        campaign = cls.__new__(cls)
        campaign._described = load_campaign(Path(file), settings, samples)
        return campaign

    def run(
        self, workers: int | None = None, *, out: str | Path | None = None,
        retry_failed: bool = False, settings: Mapping[str, Any] | None = None, part: str = "1/1",
        executor: Executor | None = None,
    ) -> xr.Dataset:  # fmt: skip
        """Run what is missing in the folder ``out`` (runs/NAME), and return the merged campaign.

        Solver processes are programs of their own (``python -m ringsim.execution.child``), not
        copies of the script: without an executor it needs no ``if __name__ == "__main__"``, with
        one that starts processes it does.  What it has defined they do not know: kinds of one's own
        stand in a module that ``imports`` names, or need ``workers = 0``.

        Parameters
        ----------
        workers
            Solver processes; None for one, 0 for this very process, which has no limits of time and
            memory.  Under an MPI launcher each rank has one: leave it out.
        out
            The folder, runs/NAME if None.  What it holds of the same campaign is kept.
        retry_failed
            Whether samples that failed run again, too.
        settings
            Solver and record settings, by scene path, of those that run again; with
            ``retry_failed`` alone.
        part
            "I/N" runs every N-th sample alone, from the I-th on.
        executor
            Any executor of ``concurrent.futures``' kind (its own, mpi4py's, dask's, parsl's): each
            of ``workers`` tasks runs a part of the samples in a solver process beside it.  All of
            them must see the folder, and have ringsim installed.

        Raises
        ------
        InputError
            If something is refused, or the folder holds another campaign or is in use.
        KeyboardInterrupt
            After Ctrl-C or another signal: the same call goes on with what is left.
        CampaignError
            If more than ``max_failed`` samples failed, or engines differ by more than
            ``max_difference``, or a task of an executor was lost, after which the same call goes
            on.  Failed samples alone are no error: see ``status``.
        """
        if settings and not retry_failed:
            raise InputError(
                f"settings: {', '.join(settings)}: they are for samples that failed: give "
                "retry_failed=True, too"
            )
        order = self._order(out, retry_failed, settings or {}, part)
        if executor is not None:
            return self._opened(order.folder, self._run_on(executor, workers, order))

        def placed() -> Order:
            require_no_launcher(workers)
            return order

        ended = start(workers, placed, lambda _: None)
        ended.require_end()
        return self._opened(order.folder, ended.code)

    def _run_on(self, executor: Executor, workers: int | None, order: Order) -> int:
        if order.share.count > 1:
            raise InputError(
                f"part = {order.share.number}/{order.share.count}: an executor runs all parts: "
                "leave it out"
            )
        if not workers or workers < 1:
            raise InputError(
                f"workers = {workers}: an executor runs so many tasks, each with a solver process: "
                "give 1 or more"
            )
        code = _run_on(executor, workers, order)
        # Parts side by side know of each other's failures what there was when they began.
        most = self._described.specification.max_failed
        many = most is not None and len(open_folder(order.folder).survey().failed) > most
        return EXIT_FAILED if many and code == EXIT_DONE else code

    def _opened(self, folder: Path, code: int) -> xr.Dataset:
        """The merged campaign, or the exception that an exit code stands for."""
        if code == EXIT_INTERRUPTED:
            raise KeyboardInterrupt
        found = open_campaign(folder)
        if code == EXIT_FAILED and (why := self._fault(folder, found)):
            found.close()
            raise CampaignError(why)
        return found

    def plan(self, workers: int | None = None, *, out: str | Path | None = None) -> str:
        """What ``run`` would do and about how long it would take, as ``--dry-run`` tells it."""
        count = max(1, workers or launched_size())
        return "\n".join(plan(self._order(out, again=False, settings={}, part="1/1"), count))

    def _order(
        self, out: str | Path | None, again: bool, settings: Mapping[str, Any], part: str
    ) -> Order:
        folder = Path(out) if out is not None else Path("runs") / self._described.specification.name
        return Order(self._described, folder, Share.parse(part), again, dict(settings))

    def _fault(self, folder: Path, found: xr.Dataset) -> str:
        survey, most = open_folder(folder).survey(), self._described.specification.max_failed
        left = len(survey.missing)
        if left or (most is not None and len(survey.failed) > most):
            return (
                f"{folder}: more samples than max_failed = {most} failed, {left} are left: raise "
                "max_failed, or run again with retry_failed=True (and other settings={...})"
            )
        if apart := too_far(found):
            return f"{folder}: {apart[0]}"
        return ""


# Campaigns whose parts are tasks of an executor.


def run_part(
    folder: Path, chosen: tuple[Any, ...], share: tuple[int, int], more: bool, call: str
) -> int:  # fmt: skip
    """Run what is missing of a part of a prepared folder, wherever an executor lets it; the exit
    code.

    ``chosen`` are an order's choices, ``share`` is (k, n), ``more`` as of ``Choices``; ``call``
    makes each call another one, as dask takes equal calls for one.

    It takes a process of its own: executors run tasks side by side in threads, which the library
    of netCDF does not bear.  InputError if it is refused; RuntimeError if that process ends
    otherwise.
    """
    path = os.pathsep.join(os.path.abspath(each) for each in sys.path)
    done = subprocess.run(
        [sys.executable, "-c", f"from {__name__} import serve_part; serve_part()"],
        input=pickle.dumps((os.getpid(), folder, chosen, share, more)), check=False,
        stdout=subprocess.PIPE, env=without_mpi() | {"PYTHONPATH": path},
    )  # fmt: skip
    if done.returncode == EXIT_BAD_INPUT:
        raise InputError(done.stdout.decode())
    if done.returncode not in (EXIT_DONE, EXIT_FAILED, EXIT_INTERRUPTED):
        raise RuntimeError(f"its process ended with exit code {done.returncode}")
    return done.returncode


def serve_part() -> None:
    """The process of a part, which is told on standard input which."""
    parent, folder, chosen, share, more = pickle.load(sys.stdin.buffer)
    end_with(parent)
    limits, most, _, again, overrides = chosen
    scheduler = Local(1)
    try:
        called = open_folder(folder).attributes["campaign_name"]
        sys.exit(run_campaign(folder, Choices(
            scheduler, limits, most, Share(*share), again, overrides, more=more, brief=True,
            label=f"{called}, part {share[0]}/{share[1]}",
        )))  # fmt: skip
    except InputError as error:
        print(error, end="")
        sys.exit(EXIT_BAD_INPUT)
    finally:
        scheduler.close()


def _run_on(executor: Executor, parts: int, order: Order) -> int:
    """Run an order in so many tasks, each a part with journals of its own; the exit code."""
    code, more = EXIT_DONE, True
    while more and code == EXIT_DONE:
        more = order.prepare()
        code = max(_round(executor, parts, order, more=more))  # a signal's 130, then failure's 3
    return code


def _round(executor: Executor, parts: int, order: Order, *, more: bool) -> set[int]:
    """The exit codes of all parts of what a folder has now."""
    folder, tasks, lost = order.folder.resolve(), list[Future[int]](), list[tuple[int, Exception]]()
    try:
        for k in range(parts):
            call = uuid.uuid4().hex
            try:
                tasks.append(
                    executor.submit(run_part, folder, order.choices, (k + 1, parts), more, call)
                )
            except BrokenExecutor as error:
                lost.append((k + 1, error))
                break
        wait(tasks)
    except BaseException:
        for task in tasks:
            task.cancel()  # those that run go on to their end
        raise
    codes = set[int]()
    for k, task in enumerate(tasks):
        try:
            codes.add(task.result())
        except InputError:
            raise
        except Exception as error:  # whatever an executor raises for a worker that has died
            lost.append((k + 1, error))
    if lost:
        number, cause = min(lost, key=lambda each: each[0])
        why = f"{type(cause).__name__}: {cause}"
        told = f"{order.folder}: part {number}/{parts} was lost ({why}): call again to run what is"
        guard = 'a script needs if __name__ == "__main__": around the call'
        raise CampaignError(f"{told} left; if no part has begun, {guard}") from cause
    return codes


def campaign_text(scene: Scene | str | Path, keys: Mapping[str, Any]) -> str:
    """The text of a campaign file from Python values, those that are None left out."""
    called = scene.name if isinstance(scene, Scene) else str(scene)
    table = {"scene": called} | {k: _plain(v) for k, v in keys.items() if v is not None}
    text = tomli_w.dumps(table)
    if isinstance(scene, Scene):
        text += "\n# The scene was a Python object: see the attribute scene for all its values."
    return text


def open_campaign(path: str | Path) -> xr.Dataset:
    """The merged campaign in a folder or a file, along ``sample``.

    A folder whose results are not merged yet, or have become more since, is merged first: samples
    that are left have the status -1.  A file of more than 200 MB is read as far as it is used:
    close it, or open it in ``with``.

    Raises
    ------
    InputError
        If there is no campaign, or none of its samples has run.
    """
    path = Path(path)
    if path.is_dir() and is_behind(path):
        merge(open_folder(path), execution="", partly=True)
    found = open_stored(path)
    if "sample" not in found.dims or "status" not in found:
        found.close()
        raise InputError(
            f"{path}: has no campaign: give the folder that ringsim campaign has written, or its "
            f"{MERGED}"
        )
    file = path / MERGED if path.is_dir() else path
    if file.stat().st_size > IN_MEMORY:
        return found
    with found:
        return found.load()


def _plain(value: Any) -> Any:
    """A value as TOML has it: nothing of numpy, no models, no paths, nothing that is not there."""
    if isinstance(value, Model):
        value = value.model_dump(exclude_none=True)
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items() if each is not None}
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    if isinstance(value, (list, tuple)):
        return [_plain(each) for each in value]
    return str(value) if isinstance(value, Path) else value
