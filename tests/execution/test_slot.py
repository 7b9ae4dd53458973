"""One supervised solver process: what it inherits, how it ends, that it is replaced."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path

import pytest

from ringsim.execution.slot import Local, Slot
from ringsim.execution.work import Allowance, Work
from ringsim.refusal import InputError
from ringsim.scene import load_scene
from ringsim.variables import Status

HERE = Path(__file__).parent
BASE = load_scene("ring18").with_values({"structure.sections": 6, "boom": "none"})


@pytest.fixture
def slots(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE))
    made = []

    def make(solver="slot_solver:run", *, allowance=None):
        made.append(Slot(solver, BASE.to_table(), allowance or Allowance()))
        return made[-1]

    yield make
    for slot in made:
        slot.close()


def result_of(slot, sample=0, force=0.015):
    slot.submit(sample, {"loads.force": force})
    return awaited(slot)


def awaited(slot, seconds=60.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        slot.pipe.poll(0.2)
        result = slot.poll()
        if result is not None:
            return result
    raise AssertionError("no result")


def process_of(result):
    return int(result.arrays()["steps"])


def test_process_is_kept_for_the_next_sample(slots):
    slot = slots()
    first, second = result_of(slot, 3), result_of(slot, 4)
    assert (first.sample, second.sample) == (3, 4)
    assert process_of(first) == process_of(second) != os.getpid()


def test_processes_stand_ready_while_more_work_follows(monkeypatch):
    """Batches of a design that grows: one process for all of them, and none is left behind."""
    monkeypatch.syspath_prepend(str(HERE))
    local, kept = Local(1), []
    for more in (True, True, False, False):
        work = Work(
            "slot_solver:run", BASE.to_table(), lambda sample: {}, Allowance(), kept.append,
            stop=lambda: "", more=more,
        )  # fmt: skip
        assert local.run([len(kept)], work) == ""
    first, second, third, fourth = (process_of(result) for result in kept)
    assert first == second == third != fourth
    for process in (first, fourth):
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)
    local.run([4], replace(work, more=True))
    local.close()
    with pytest.raises(ProcessLookupError):
        os.kill(process_of(kept[-1]), 0)


def test_process_is_replaced_after_its_share_of_runs(slots):
    slot = slots(allowance=Allowance(recycle=2))
    processes = [process_of(result_of(slot)) for _ in range(5)]
    assert processes[0] == processes[1] != processes[2] == processes[3] != processes[4]


def test_process_killed_by_somebody_else_runs_its_sample_again(slots):
    slot = slots("slot_solver:sleep")
    first = process_of(result_of(slot))
    slot.submit(1, {})
    os.kill(first, signal.SIGKILL)
    result = awaited(slot)
    assert result.status is Status.OK
    assert process_of(result) != first


def test_run_that_was_suspended_with_its_supervisor_is_no_hang(slots):
    """As by a batch system: nobody ran, so the time does not count."""
    slot = slots("slot_solver:sleep", allowance=Allowance(timeout=1.0))
    process = process_of(result_of(slot))
    slot.submit(1, {})
    slot.poll()
    os.kill(process, signal.SIGSTOP)
    time.sleep(1.3)
    assert slot.poll() is None
    os.kill(process, signal.SIGCONT)
    assert awaited(slot).status is Status.OK


def test_process_that_cannot_be_started_is_refused(slots, monkeypatch):
    slot = slots()
    monkeypatch.setattr(sys, "executable", "/no/python")
    with pytest.raises(InputError, match=r"cannot be started.*use fewer workers"):
        slot.submit(0, {})
    slot.close()


def test_stop_signal_to_a_process_that_is_just_starting_is_not_its_fault(slots):
    slot = slots()
    slot.submit(0, {"loads.force": 0.015})
    os.kill(slot.pid, signal.SIGUSR1)
    assert awaited(slot).status is Status.OK


def test_process_that_is_killed_again_and_again_is_given_up(slots):
    slot = slots("slot_solver:kill_itself")
    result = result_of(slot)
    assert result.status is Status.CRASHED
    assert "SIGKILL" in result.reason
    assert result_of(slots()).status is Status.OK


def test_printing_without_end_does_not_fill_the_disk(slots):
    result = result_of(slots("slot_solver:chatter"))
    assert result.status is Status.ERROR
    assert "File too large" in result.reason or "OSError" in result.reason


def test_runs_have_a_folder_of_their_own(slots):
    slot = slots("slot_solver:litter")
    result = result_of(slot)
    folder = Path(result.reason)
    assert (folder / "litter").exists()
    slot.close()
    assert not folder.exists()


def test_hang_that_holds_the_interpreter_is_ended(slots):
    slot = slots("slot_solver:hold_the_lock", allowance=Allowance(timeout=1.0))
    result = result_of(slot)
    assert result.status is Status.TIMEOUT
    assert "hold_the_lock" in result.log


def test_solver_process_ends_with_its_parent():
    script = textwrap.dedent(
        """
        import os, sys, time
        from ringsim.execution.slot import Slot
        from ringsim.execution.work import Allowance
        from ringsim.scene import load_scene
        slot = Slot("slot_solver:sleep", load_scene("ring18").to_table(), Allowance())
        slot.submit(0, {})
        while slot.poll() is None:
            pass
        slot.submit(1, {"solver.end_time": 1000.0})
        print(slot.pid, flush=True)
        os.kill(os.getpid(), 9)
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False,
        env=os.environ | {"PYTHONPATH": str(HERE)},
    )  # fmt: skip
    assert done.returncode == -signal.SIGKILL, done.stderr
    orphan = Path(f"/proc/{int(done.stdout)}/stat")
    end = time.monotonic() + 10.0
    while orphan.exists() and orphan.read_text().rsplit(")", 1)[1].split()[0] != "Z":
        assert time.monotonic() < end, "the solver process outlived its parent"
        time.sleep(0.05)
