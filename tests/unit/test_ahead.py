"""Steps begun ahead: made once, waited for, and their errors told to who asks for them."""

import threading

import pytest

from evalsuite.errors import WorkerFailed
from evalsuite.steps import Steps
from evalsuite.store.cache import Store


@pytest.fixture
def steps(tmp_path):
    return Steps(Store(tmp_path), workers=None)


def test_it_is_made_once_beside_what_the_caller_does_meanwhile(steps):
    began, go_on, made = threading.Event(), threading.Event(), []

    def step():
        def make():
            began.set()
            go_on.wait(10)
            made.append(1)
            return steps.store.put("kind", "ab12", {"x": 1})

        return steps.once("kind", "ab12", make)

    steps.ahead(step)
    assert began.wait(10) and not made  # while nobody has asked for it, and this thread is free
    threading.Timer(0.05, go_on.set).start()
    assert step()[1] == {"x": 1}
    assert made == [1]


def test_an_error_is_told_to_who_asks_and_to_nobody_else(steps, monkeypatch):
    began, before, loud = threading.Event(), set(threading.enumerate()), []
    monkeypatch.setattr(threading, "excepthook", loud.append)

    def step():
        def make():
            began.set()
            raise WorkerFailed("formulas worker", "a dead process", "a result")

        return steps.once("kind", "cd34", make)

    steps.ahead(step)
    assert began.wait(10)
    with pytest.raises(WorkerFailed, match="dead process"):
        step()
    for thread in set(threading.enumerate()) - before:
        thread.join(10)
    assert not loud
