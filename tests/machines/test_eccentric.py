"""An axis that turns an eccentric load: gravity's torque, what holds it, what it may not be."""

import math

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.machines import contract, homing, machine, planning, runs, sheets
from macromicro.machines.rotary import DEFAULT
from macromicro.plant import axis

ROTARY = machine.MACHINES[3]
DEG = math.pi / 180.0
NOISE = np.zeros((1, 1))
DT = 1e-3
ECCENTRIC = DEFAULT.with_({"load.unbalance": "0.5 N*m", "load.hangs": "-90 deg"})


def pendulum(frequency=0.0):
    """A load that hangs at 30 deg, which nothing rubs and no motor drives."""
    tree = DEFAULT.with_(
        {
            "load.unbalance": "0.2 N*m",
            "load.hangs": "30 deg",
            "drive.frequency": f"{frequency} Hz",
            "drive.damping": 0.0,
        }
    )
    free = tree.friction._replace(coulomb=0.0, stribeck=0.0, viscous=0.0)
    p = ROTARY.kind.prepare(tree._replace(friction=free))
    return tree, p._replace(power=p.power._replace(push=0.0, emf=0.0))


def swung(p, turned, periods):
    s = axis.at_rest(p)._replace(x=turned, xm=turned)
    places = [s.x]
    for _ in range(periods):
        s = axis.advance(p, s, 0.0, NOISE, 0, DT)
        places.append(s.x)
    return np.array(places)


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [0.0, 60.0])
def test_it_swings_about_where_it_hangs_as_a_pendulum_does(frequency):
    tree, p = pendulum(frequency)
    inertia = sheets.mass(tree)
    places = swung(p, 40.0 * DEG, 20_000) - 30.0 * DEG
    upward = np.flatnonzero((places[:-1] < 0.0) & (places[1:] >= 0.0))
    lasts = (upward[-1] - upward[0]) * DT / (len(upward) - 1)
    # 1 + a^2/16: of a pendulum that swings by a
    slow = 2.0 * math.pi * math.sqrt(inertia / 0.2) * (1.0 + (10.0 * DEG) ** 2 / 16.0)
    assert lasts == pytest.approx(slow, rel=2e-3)
    for part in (places[:2000], places[-2000:]):  # it keeps its energy
        assert np.max(np.abs(part)) == pytest.approx(10.0 * DEG, rel=2e-3)


def test_compiled_it_does_the_same():
    _, p = pendulum()
    s = axis.at_rest(p)._replace(x=1.0, xm=1.0, v=2.0, vm=2.0)
    plain = axis.advance(p, s, 0.3, NOISE, 0, DT)
    quick = compiled(axis.advance)(p, s, 0.3, NOISE, 0, DT)
    assert tuple(quick) == pytest.approx(tuple(plain), rel=1e-12)


def test_the_sheets_count_the_worst_place_for_the_motor_and_each_place_for_the_rest():
    assert sheets.gravity_at(ECCENTRIC, -90.0 * DEG) == pytest.approx(0.0, abs=1e-12)
    assert sheets.gravity_at(ECCENTRIC, 0.0) == pytest.approx(0.5)
    assert sheets.gravity_at(ECCENTRIC, 180.0 * DEG) == pytest.approx(-0.5)
    assert sheets.heaviest(ECCENTRIC) == pytest.approx(0.5)
    assert sheets.breakaway_force(ECCENTRIC) == pytest.approx(sheets.breakaway_force(DEFAULT) + 0.5)
    assert sheets.sliding_force(ECCENTRIC) == pytest.approx(sheets.sliding_force(DEFAULT) + 0.5)
    assert ECCENTRIC.motion.acceleration < DEFAULT.motion.acceleration
    per_newton = sheets.per_newton(ECCENTRIC)
    assert ECCENTRIC.controller.ahead_unbalance == pytest.approx(0.5 * per_newton, rel=1e-3)
    assert ECCENTRIC.controller.hangs == -90.0 * DEG
    # Pulled into its stop at -5 deg it leans more, so it stands lower than without.
    assert homing.touch(ECCENTRIC).place < homing.touch(DEFAULT).place - 1e-4


def test_a_load_that_the_motor_cannot_lift_is_refused():
    with pytest.raises(InputError) as error:
        DEFAULT.with_("load.unbalance", "0.9 N*m")
    assert "N*m" in error.value.accepted and "weight" in error.value.accepted


def test_it_keeps_what_every_machine_must():
    assert contract.broken(ROTARY._replace(settings=ECCENTRIC)) == []


def test_the_law_holds_it_everywhere():
    plan = planning.plan(planning.usual(ECCENTRIC), ECCENTRIC)
    done = runs.record(ROTARY, ECCENTRIC, plan, seed=3)
    assert done.outcome.fault is None and np.max(done.recording["arrived"]) == 1.0
    without = ECCENTRIC.with_("controller.ahead_unbalance", "0 V")
    poor = runs.record(ROTARY, without, planning.plan(planning.usual(without), without), seed=3)

    def error(seen):
        return np.sqrt(np.mean((seen["target"] - seen["position"]) ** 2))

    assert error(done.recording) < 0.4 * error(poor.recording)
    # At rest far from where it hangs the effort is that of the torque there.
    seen, per_newton = done.recording, sheets.per_newton(ECCENTRIC)
    still = np.abs(seen["true_speed"]) < 1e-4
    torque = 0.5 * np.sin(seen["true_position"] * DEG + 90.0 * DEG)
    rubs = per_newton * (ECCENTRIC.friction.coulomb + ECCENTRIC.friction.stribeck)
    assert np.count_nonzero(still) > 100
    assert np.all(np.abs(seen["effort"][still] - per_newton * torque[still]) < 1.2 * rubs + 0.02)
