"""What the progress bar says of speed and time left, by a clock that is told."""

from __future__ import annotations

import pytest

from evalsuite.pace import Pace


class Clock:
    now = 50.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


def test_samples_a_second_are_those_of_rendering(clock):
    pace = Pace(4, clock=clock)
    assert pace.rate is None and str(pace) == ""
    pace.samples(3e6, 1.0)
    clock.now += 100  # other work does not count
    pace.samples(9e6, 2.0)
    assert pace.rate == 4e6 and str(pace) == "4 Ms/s"


def test_without_a_forecast_cells_tell(clock):
    pace = Pace(4, clock=clock)
    clock.now += 30
    assert pace.left is None
    pace.cell()
    assert pace.left == pytest.approx(90) and str(pace) == "1 min 30 s left"
    clock.now += 30
    pace.cell()
    assert pace.left == pytest.approx(60)
    pace.cell(), pace.cell()
    assert pace.left == 0


def test_a_forecast_is_corrected_by_what_was_done(clock):
    pace = Pace(10, clock=clock)
    pace.expect(100.0, 1e9)
    assert pace.left == pytest.approx(100)
    # On time: half of the samples and of the cells in half of the time.
    clock.now += 50
    pace.samples(0.5e9, 40.0)
    for _ in range(5):
        pace.cell()
    assert pace.share == 0.5 and pace.left == pytest.approx(50)
    # Twice as slow from the start: nearer to the 100 s that it takes than to the 50 s that were foretold.
    slow = Pace(10, clock=clock)
    slow.expect(100.0, 1e9)
    clock.now += 100
    slow.samples(0.5e9, 40.0)
    for _ in range(5):
        slow.cell()
    assert slow.left == pytest.approx(50 * (100 + 30) / (50 + 30))
    slow.samples(9e9, 40.0)
    assert slow.share == 0.75, "more samples than foretold are all of them"


def test_a_forecast_without_samples_goes_by_cells(clock):
    pace = Pace(2, clock=clock)
    pace.expect(10.0, 0.0)
    pace.cell()
    clock.now += 5
    assert pace.left == pytest.approx(5)


def test_a_budget_is_what_is_left_of_it(clock):
    pace = Pace(2, 60.0, clock)
    clock.now += 45
    assert pace.left == 15 and str(pace) == "15 s left"
    clock.now += 45
    assert pace.left == 0
