"""``python -m ringsim`` is the command ``ringsim``: one thread first, then all the rest."""

import resource
import signal
import sys
from typing import Any

from ringsim.threads import one_thread_from_here_on

_LEAST = 450_000 * 1024
"""Bytes of address space that numpy, scipy and netCDF4 take.  With a little less OpenBLAS fails to
reserve its buffer and tries again for ever.
"""


def main() -> None:
    """Entry point of the command: numpy must not be loaded before its threads are counted."""
    asked: list[int] = []
    before: dict[int, Any] = {}

    def stop(number: int, _: object) -> None:
        """Unwind, so that no draft is left."""
        asked.append(number)
        raise KeyboardInterrupt

    hook = sys.unraisablehook

    def unheard(raised: Any) -> None:
        """Say nothing of a signal in an answer to the core, which stops then."""
        of_core = raised.exc_type is KeyboardInterrupt and "ctypes callback" in str(raised.err_msg)
        if not (asked and of_core):
            hook(raised)

    sys.unraisablehook = unheard
    try:
        # Campaigns have their own way to end.
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            # nohup has SIGHUP ignored.
            if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):
                before[number] = signal.signal(number, stop)
        one_thread_from_here_on()
        if 0 <= resource.getrlimit(resource.RLIMIT_AS)[0] < _LEAST:
            raise MemoryError
        from ringsim.cli import main as command

        command()
    except (KeyboardInterrupt, Exception) as error:
        # While it loads, when an interrupt may come out as an error of what was being loaded; later
        # ringsim.cli tells the same.
        if asked or isinstance(error, KeyboardInterrupt):
            print("interrupted", file=sys.stderr)
            sys.exit(130)
        # A library that does not fit is told as one that cannot be imported.
        if not isinstance(error, MemoryError) and "failed to map segment" not in str(error):
            raise
        told = "there is too little memory: raise the limit (ulimit -v), or ask for less at once"
        print(told, file=sys.stderr)
        sys.exit(2)
    finally:
        sys.unraisablehook = hook
        # Of an interrupt in code that was given as text, as that of named tuples, Python remembers
        # that nobody caught it, and ends by SIGINT whatever the exit code, until the next such.
        eval("0")
        for which, handler in before.items():
            signal.signal(which, handler)


if __name__ == "__main__":
    main()
