"""``python -m ringsim`` is the command ``ringsim``: one thread first, then all the rest."""

import resource
import signal
import sys

from ringsim.threads import one_thread_from_here_on

_LEAST = 450_000 * 1024
"""Bytes of address space that numpy, scipy and netCDF4 take.  With a little less OpenBLAS fails to
reserve its buffer and tries again for ever.
"""


def main() -> None:
    """Entry point of the command: numpy must not be loaded before its threads are counted."""
    try:
        # As Ctrl-C, so that no draft is left; campaigns have their own way to end.
        for number in (signal.SIGTERM, signal.SIGHUP):
            if signal.getsignal(number) is signal.SIG_DFL:  # nohup has it ignored
                signal.signal(number, signal.default_int_handler)
        one_thread_from_here_on()
        if 0 <= resource.getrlimit(resource.RLIMIT_AS)[0] < _LEAST:
            raise MemoryError
        from ringsim.cli import main as command

        command()
    except KeyboardInterrupt:  # while it loads; later ringsim.cli tells the same
        print("interrupted", file=sys.stderr)
        sys.exit(130)
    except (MemoryError, ImportError) as error:
        # A library that does not fit is told as one that cannot be imported.
        if isinstance(error, ImportError) and "failed to map segment" not in str(error):
            raise
        told = "there is too little memory: raise the limit (ulimit -v), or ask for less at once"
        print(told, file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
