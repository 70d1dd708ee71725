"""A native abort or a hang costs one task; the lane goes on."""

from pathlib import Path

import pytest

from evalsuite.errors import EvalsuiteError, WorkerFailed
from evalsuite.execute.local import Lane


@pytest.fixture
def lane(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))  # where the spawned process finds `crashing`
    lane = Lane("test", limit_s=20)
    yield lane
    lane.close()


def test_abort_costs_one_task_and_names_the_signal(lane):
    futures = [lane.submit("crashing:square", 3), lane.submit("crashing:abort"), lane.submit("crashing:square", 4)]
    assert futures[0].result() == 9
    with pytest.raises(WorkerFailed, match=r"SIGABRT.*out of registers"):
        futures[1].result()
    assert futures[2].result() == 16


def test_exit_code_is_told(lane):
    with pytest.raises(WorkerFailed, match="exit code 7"):
        lane.call("crashing:leave")


def test_hang_ends_at_the_limit(lane):
    lane._limit_s = 2
    with pytest.raises(WorkerFailed, match="no answer in 2 s"):
        lane.call("crashing:hang")
    lane._limit_s = 20
    assert lane.call("crashing:square", 5) == 25


def test_a_refusal_arrives_as_it_is(lane):
    with pytest.raises(EvalsuiteError, match=r"scene\.xml: got a cube") as caught:
        lane.call("crashing:refuse")
    assert not isinstance(caught.value, WorkerFailed)


def test_worker_ignores_ctrl_c(lane):
    assert lane.call("crashing:interrupt_is_ignored") == "alive"
