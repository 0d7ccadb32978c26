"""Strokes of the carriage: the same on the twin as a rig and compiled, and within the travel."""

import numpy as np

from macromicro.plant import bench
from macromicro.settings import Settings
from macromicro.thesis import strokes

PLANT = bench.prepare(Settings().bench, Settings().sensors)


def test_efforts_go_each_way_in_turn_with_a_rest_between() -> None:
    u = strokes.efforts(4.0)
    assert np.abs(u).max() == 4.0
    begins = np.flatnonzero((u[1:] != 0.0) & (u[:-1] == 0.0)) + 1
    signs = np.sign(u[begins])
    assert len(begins) == 2 * len(strokes.PULSES)
    assert (signs[::2] == 1.0).all() and (signs[1::2] == -1.0).all()
    assert not u[: strokes.REST].any() and not u[-strokes.REST :].any()


def test_nudges_do_not_move_the_carriage_by_a_count() -> None:
    u = strokes.nudges(5.0)
    assert np.abs(u).max() == 0.25 and not u[: strokes.REST].any() and not u[-strokes.REST :].any()
    run = strokes.stroke(PLANT, u, 700.0)
    assert np.ptp(run["macro_position"]) == 0.0
    assert 1.0 < np.ptp(run["laser"][strokes.REST :]) < 20.0  # um


def test_they_stay_within_the_travel_and_come_back() -> None:
    run = strokes.stroke(PLANT, strokes.efforts(5.0), 700.0)
    x = run["macro_position"]
    assert x[0] == 700.0
    assert 0.0 < x.min() < x.max() < 2800.0
    assert x.max() - x.min() > 900.0
    assert abs(x[-1] - x[0]) < 200.0


def test_the_laser_sees_carriage_and_swing() -> None:
    run = strokes.stroke(PLANT, strokes.efforts(5.0)[:620], 700.0)
    pitch = Settings().sensors.encoder.pitch
    off = run["laser"] * 1e-6 - (run["macro_position"] - 700.0) * pitch
    assert np.abs(off).max() < 3.0 * pitch  # within the count, and the swing
    still = run["laser"][450:]
    assert 20.0 < np.ptp(still) < 300.0  # um: the swing
