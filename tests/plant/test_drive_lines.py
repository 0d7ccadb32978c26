"""A drive gives current while its enable line is on, and trips by the heat of its current."""

from __future__ import annotations

import math

import pytest

from macromicro.plant import drive_lines
from macromicro.plant.drive_lines import Drive, Wiring

PEAK, CONTINUOUS, LASTS = 4.0, 2.0, 2.0
WIRING = Wiring(1, 0.02, 1, CONTINUOUS, drive_lines.slow(PEAK, CONTINUOUS, LASTS))
ON = Drive(1.0, 1.0, 0.0, 0.0)
DT = 1e-3


def after(p, s, current, seconds):
    for _ in range(round(seconds / DT)):
        s = drive_lines.advanced(p, s, current, DT)
    return s


def test_the_greatest_current_trips_it_after_its_time_and_the_continuous_one_never():
    assert after(WIRING, ON, PEAK, 0.99 * LASTS).fault == 0.0
    assert after(WIRING, ON, -PEAK, 1.01 * LASTS).fault == 1.0
    # What is left of the heat by half the current is a quarter of the continuous one's.
    assert after(WIRING, ON, CONTINUOUS, 60.0).fault == 0.0
    assert after(WIRING, ON, 0.5 * CONTINUOUS, 60.0).heat == pytest.approx(0.25, rel=1e-3)
    assert after(WIRING, ON, 1.05 * CONTINUOUS, 60.0).fault == 1.0
    assert drive_lines.slow(PEAK, CONTINUOUS, LASTS) == pytest.approx(2.0 / math.log(4.0 / 3.0))
    assert drive_lines.slow(2.0, 2.0, LASTS) == math.inf
    without = after(WIRING._replace(fault=0), ON, PEAK, 10.0)
    assert (without.fault, without.heat) == (0.0, 0.0) and without.on > 10.0


def test_a_fault_stays_until_the_line_is_off_and_the_drive_has_cooled():
    hot = after(WIRING, ON, PEAK, 2.1)
    assert not drive_lines.ready(WIRING, hot)
    assert after(WIRING, hot, 0.0, 60.0).fault == 1.0  # still asked for
    off = hot._replace(asked=0.0)
    warm = off._replace(heat=0.95)
    assert after(WIRING, warm, 0.0, 0.1).fault == 1.0
    assert after(WIRING, warm, 0.0, 0.1).heat > drive_lines.COOL
    cool = after(WIRING, off, 0.0, 5.0)
    assert cool.fault == 0.0 and cool.heat < drive_lines.COOL
    # Without an enable line nobody can ask for less.
    assert after(WIRING._replace(enable=0), hot, 0.0, 5.0).fault == 0.0


def test_it_gives_current_once_it_has_been_on_for_its_time():
    s = Drive(0.0, 0.0, 0.0, 0.0)
    assert not drive_lines.ready(WIRING, after(WIRING, s, 0.0, 1.0))
    on = s._replace(asked=1.0)
    assert not drive_lines.ready(WIRING, after(WIRING, on, 0.0, 0.019))
    assert drive_lines.ready(WIRING, after(WIRING, on, 0.0, 0.02))
    again = drive_lines.advanced(WIRING, after(WIRING, on, 0.0, 1.0)._replace(asked=0.0), 0.0, DT)
    assert again.on == 0.0 and not drive_lines.ready(WIRING, again._replace(asked=1.0))
    assert drive_lines.ready(WIRING._replace(enable=0), s)
    assert not drive_lines.ready(WIRING._replace(enable=0), s._replace(fault=1.0))
    assert not drive_lines.ready(WIRING, Drive(0.0, 1.0, 0.0, 0.0))
