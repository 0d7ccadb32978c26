"""A stage under its law and without one: simulated and on a rig the same bits."""

import numpy as np
import pytest

from macromicro.machines import machine, planning, runs, stage
from macromicro.machines.rig import Twin
from macromicro.machines.stage import Bounds

AXIS = machine.MACHINES[0]
USUAL = planning.usual(AXIS.settings)
SHORT = USUAL._replace(
    start=USUAL.start[:1], stage=USUAL.stage[:1], target=USUAL.target[:1], hold=USUAL.hold[:1] / 6.0
)


@pytest.fixture(scope="module")
def short():
    return runs.record(AXIS, AXIS.settings, SHORT)


def test_a_move_arrives_where_it_should(short):
    found = short.recording
    assert short.outcome.finished and short.outcome.fault is None
    pitch = AXIS.settings.encoder.pitch * 1e3
    assert abs(found["true_position"][-1] - SHORT.target[0] * pitch) < 3.0 * pitch


def test_a_rig_is_driven_by_the_same_control_period(short):
    on = runs.record(AXIS, AXIS.settings, SHORT, on=Twin(AXIS.kind, AXIS.settings))
    assert on.outcome.finished
    names = [c.name for c in on.recording.columns]
    assert "true_position" not in names and "effort" in names
    for name in names:
        assert np.array_equal(on.recording[name], short.recording[name]), name


def test_a_drive_without_a_law_ends_at_its_bounds():
    kind, params = AXIS.kind, AXIS.kind.prepare(AXIS.settings)
    dt, wide = AXIS.settings.timing.period, Bounds(-1.0, 1.0, 10.0)
    efforts = np.full(300, 2.0)
    free = stage.drive(kind, params, efforts, wide, dt)
    assert free.ended == "" and len(free.t) == 300 and free.position[-1] > 0.05
    for bounds, why in (
        (wide._replace(high=0.02), "high"),
        (wide._replace(speed=0.3), "speed"),
    ):
        met = stage.drive(kind, params, efforts, bounds, dt)
        assert met.ended == why and met.effort[-1] == 0.0 and met.effort[-2] == 2.0
        assert np.array_equal(met.position, free.position[: len(met.t)])
    assert stage.drive(kind, params, -efforts, wide._replace(low=-0.001), dt).ended == "low"
