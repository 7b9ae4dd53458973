"""Signals and locks of a campaign."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

from ringsim.campaign.watch import stopping_on_signals
from ringsim.refusal import InputError
from ringsim.storage.netcdf import locked

pytestmark = pytest.mark.quick


@pytest.fixture
def hang_up():
    """The signal of a terminal that is closed, handled as before at the end."""
    before = signal.getsignal(signal.SIGHUP)
    yield signal.SIGHUP
    signal.signal(signal.SIGHUP, before)


def test_a_terminal_that_closes_stops_a_campaign_as_other_signals_do(hang_up) -> None:
    signal.signal(hang_up, signal.SIG_DFL)
    with stopping_on_signals() as stop:
        signal.raise_signal(hang_up)
        assert stop.reason == "stopped by SIGHUP"
        assert signal.getsignal(hang_up) == signal.SIG_DFL
    assert stop.signalled


def test_under_nohup_it_goes_on(hang_up) -> None:
    signal.signal(hang_up, signal.SIG_IGN)
    with stopping_on_signals() as stop:
        signal.raise_signal(hang_up)
        assert not stop.reason
    assert signal.getsignal(hang_up) == signal.SIG_IGN


def test_a_lock_that_is_a_link_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "lock").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="lock: is a link"), locked(tmp_path / "lock"):
        pass
    assert not (tmp_path / "elsewhere").exists()
    (tmp_path / "elsewhere").touch()
    with pytest.raises(InputError, match="lock: is a link"), locked(tmp_path / "lock"):
        pass
