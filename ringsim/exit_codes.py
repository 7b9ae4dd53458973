"""How the command ``ringsim`` ends."""

EXIT_DONE = 0
EXIT_BAD_INPUT = 2
EXIT_FAILED = 3
"""The simulation failed, or too many samples of a campaign did."""
EXIT_NOT_MET = 4
"""A requirement is not met, or not yet shown to be (``analyse --gate``)."""
EXIT_INTERRUPTED = 130
"""Stopped by a signal, or samples are left: the same command goes on (128 + SIGINT)."""
