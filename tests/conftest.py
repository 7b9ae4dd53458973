"""Settings that all tests share."""

from ringsim.threads import one_thread_from_here_on

one_thread_from_here_on()  # as the command does, before numpy is loaded

from hypothesis import settings  # noqa: E402

settings.register_profile("repeatable", deadline=None, derandomize=True)
settings.register_profile("explore", deadline=None, max_examples=1000)
settings.load_profile("repeatable")
