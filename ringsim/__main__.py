"""``python -m ringsim`` is the command ``ringsim``: one thread first, then all the rest."""

import sys

from ringsim.threads import one_thread_from_here_on


def main() -> None:
    """Entry point of the command: numpy must not be loaded before its threads are counted."""
    try:
        one_thread_from_here_on()
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
