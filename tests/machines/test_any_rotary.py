"""Axes that turn, drawn at random from what there is on the market, run untuned."""

import math

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.machines import machine, planning
from macromicro.machines.runs import StageSetup

ROTARY = machine.MACHINES[3]


def drawn(rng):
    """The changes of one, as a file would write them: from a gimbal motor to a geared turntable."""

    def between(low, high):
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    ratio = 1.0 if rng.random() < 0.3 else between(3, 150)
    constant = between(0.02, 0.3) if ratio == 1.0 else between(0.005, 0.08)
    resistance, supply = between(0.5, 15), between(12, 48)
    rotor = between(1e-7, 2e-5) * (5.0 if ratio == 1.0 else 1.0)
    current = min(between(0.5, 8), supply / resistance)
    torque = current * constant * ratio
    changes = {
        "drive.ratio": ratio,
        "drive.inertia": f"{between(1e-8, 1e-6)} kg*m^2",
        "drive.efficiency": rng.uniform(0.5, 0.95) if ratio > 1.0 else 1.0,
        "amplifier.mode": ["voltage", "current"][rng.integers(2)],
        "amplifier.supply": f"{supply} V",
        "amplifier.current": f"{current} A",
        "motor.constant": f"{constant} N*m/A",
        "motor.resistance": f"{resistance} ohm",
        "motor.inductance": f"{between(0.05, 3)} mH",
        "motor.inertia": f"{rotor} kg*m^2",
        "load.inertia": f"{rotor * ratio * ratio * between(0.3, 10)} kg*m^2",
        "load.stop_low": f"{-between(1, 20)} deg",
        "load.stop_high": f"{between(20, 350)} deg",
        "load.stop_stiffness": f"{between(20, 200) * torque} N*m/rad",
        "load.stop_damping": f"{0.02 * torque} N*m*s/rad",
        "friction.coulomb": f"{torque * between(0.01, 0.15)} N*m",
        "friction.stribeck": f"{torque * between(0.002, 0.04)} N*m",
        "friction.viscous": f"{torque * between(0.0005, 0.01)} N*m*s/rad",
        "friction.presliding": f"{between(1, 30)} mdeg",
        "timing.period": f"{between(0.1, 1)} ms",
        "timing.delay": "0.05 ms",
        "encoder.counts": between(2000, 65536),
        "encoder.rate": "1e8 counts/s",
    }
    if rng.random() < 0.5 or ratio == 1.0:
        changes |= {"encoder.at": "load", "encoder.counts": between(10_000, 1_000_000)}
    if rng.random() < 0.4 and ratio > 1.0:
        changes |= {"drive.frequency": f"{between(10, 150)} Hz", "drive.damping": 0.03}
        if rng.random() < 0.5:
            changes |= {"drive.backlash": f"{between(0.5, 20)} arcmin"}
    return changes


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_nearly_all_that_are_not_refused_arrive_at_every_target(seed):
    rng = np.random.default_rng(seed)
    arrived, ran = 0, 0
    for _ in range(30):
        try:
            settings = ROTARY.settings.with_(drawn(rng))
        except InputError as refused:
            assert "friction" in refused.where or "timing" in refused.where
            continue
        plan = planning.plan(planning.usual(settings), settings)
        found = StageSetup(ROTARY, settings, plan).trial(0)
        ran += 1
        arrived += found.fault == 0.0 and found.missed == 0.0
    assert ran >= 15 and arrived >= 0.9 * ran
