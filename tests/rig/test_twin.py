"""The twin: the bench as a rig; its compiled form gives the same bits."""

import math

import pytest

from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.plant import bench
from macromicro.plant.bench import Bench, Sensors
from macromicro.rig.twin import CompiledTwin, Twin
from macromicro.types import SAFE, Outputs

PLANT = bench.prepare(Bench(), Sensors())


def twins(seed=3):
    start = bench.initial(PLANT, 0.03)
    again = bench.initial(PLANT, 0.03)
    stepped = Twin(
        PLANT, seed, state=start, measure=compiled(bench.measure), advance=compiled(bench.advance)
    )
    return stepped, CompiledTwin(PLANT, seed, state=again)


def outputs(k):
    """A pull to and fro, heat, fan, and a laser reset now and then."""
    return Outputs(4.5 * math.sin(k / 70.0), 1.6, float(k // 400 % 2), float(k % 500 == 99))


def test_the_compiled_twin_gives_the_bits_of_the_twin():
    stepped, running = twins()
    for k in range(2500):
        assert running.read() == stepped.read()
        if k % 300 == 0:
            assert running.truth() == stepped.truth()
        for twin in (stepped, running):
            twin.write(outputs(k))
            twin.clock.wait(1e-3)
    assert running.truth().carriage != 0.03
    assert running.truth().wire > 30.0
    assert running.clock.now() == stepped.clock.now() == 2.5


def test_readings_of_one_period_are_one_reading():
    _, running = twins()
    assert running.read() == running.read()


def test_a_laser_reset_is_given_once():
    _, running = twins()
    running.write(SAFE._replace(laser_reset=1.0))
    running.clock.wait(1e-3)
    first = running.read().laser
    running.clock.wait(1e-3)
    assert abs(first) < 5e-6
    assert running.read().laser != first


def test_its_state_cannot_be_looked_at():
    """It is inside compiled code: an old one would be believed."""
    _, running = twins()
    with pytest.raises(AttributeError):
        _ = running.state


def test_leaving_makes_the_outputs_safe():
    _, running = twins()
    with running:
        running.write(Outputs(5.0, 2.0, 1.0, 0.0))
        running.clock.wait(1e-3)
    before = running.truth().carriage
    for _ in range(400):
        running.clock.wait(1e-3)
    still = running.truth().carriage
    running.clock.wait(1e-3)
    assert abs(still - before) < 0.05
    assert running.truth().speed == pytest.approx(0.0, abs=1e-6)


def test_another_period_is_refused():
    _, running = twins()
    with pytest.raises(InputError, match=r"dt: '0\.002 s'; accepted: 0\.001 s, the period"):
        running.clock.wait(2e-3)
