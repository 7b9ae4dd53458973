"""``python -m ringsim`` is the command ``ringsim``: one thread first, then all the rest."""

from ringsim.threads import one_thread_from_here_on


def main() -> None:
    """Entry point of the command: numpy must not be loaded before its threads are counted."""
    one_thread_from_here_on()
    from ringsim.cli import main as command

    command()


if __name__ == "__main__":
    main()
