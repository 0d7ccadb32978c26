"""What an axis cannot do is refused before it runs, with the numbers."""

import pytest

from macromicro.errors import InputError
from macromicro.machines.axis import DEFAULT

K = 0.0302 / 8e-3
# 70 % of 24 V, less what 3 N take at rest, over back-EMF and viscous friction; all of it at most.
TOP = (0.7 * 24.0 - 1.2 / K * 3.0) / (K + 1.2 / K * 2.0) / 0.7
POLE = (2.0 + K * K / 1.2) / (0.5 + 2.4e-6 / 8e-3**2)

CASES = [
    ({"travel.high": "320 mm"}, "travel.high", "load.stop_high (305 mm)"),
    ({"travel.low": "-8 mm"}, "travel.low", "load.stop_low (-5 mm)"),
    ({"travel.low": "-3 mm", "guard.low": "-2 mm"}, "travel.low", "guard.low (-2 mm)"),
    ({"travel.high": "301 mm", "guard.high": "300 mm"}, "travel.high", "guard.high (300 mm)"),
    ({"travel.low": "1 mm"}, "travel.low", "0 mm"),
    ({"guard.high": "310 mm"}, "guard.high", "load.stop_high (305 mm)"),
    ({"guard.low": "-6 mm"}, "guard.low", "load.stop_low (-5 mm)"),
    ({"friction.coulomb": "12 N"}, "friction.coulomb", "this axis takes 12.6 N to start"),
    ({"load.payload": "8 kg", "load.incline": "90 deg"}, "friction.coulomb", "takes 86.96 N"),
    ({"motion.acceleration": "25 m/s^2"}, "motion.acceleration", "at most 21.4 m/s^2"),
    ({"motion.velocity": "9 m/s"}, "motion.velocity", "amplifier.supply (24 V)"),
    ({"motion.velocity": "9 m/s"}, "motion.velocity", f"at most {TOP:.4g} m/s"),
    ({"guard.effort": "11 V"}, "guard.effort", "amplifier.full_scale (10 V)"),
    ({"controller.limit": "10.5 V"}, "controller.limit", "guard.effort (10 V)"),
    ({"arrival.tolerance": "10 um"}, "arrival.tolerance", "12.5664 um"),
    (
        {"encoder.rate": "100000 counts/s", "motion.velocity": "1.3 m/s"},
        "motion.velocity",
        "at most 1.257 m/s: it makes 1.035e+05 counts/s",
    ),
    ({"encoder.bits": 15}, "encoder.bits", "24271 counts"),
    ({"timing.delay": "2 ms"}, "timing.delay", "timing.period (1 ms)"),
    ({"drive.backlash": "10 um"}, "drive.backlash", "drive.frequency above 0 Hz"),
    ({"drive.frequency": "150 Hz"}, "timing.period", "at most 0.6667 ms"),
    (
        {"drive.frequency": "50 Hz", "motor.inertia": 0, "drive.inertia": 0},
        "drive.frequency",
        "a mass at either end",
    ),
    ({"controller.velocity": "60 V*s/m"}, "controller.velocity", "at most 769.2 rad/s"),
    ({"timing.period": "30 ms"}, "timing.period", f"at most {500.0 / POLE:.4g} ms, half"),
    ({"guard.silent": "0.5 ms"}, "guard.silent", "timing.period (1 ms)"),
    ({"guard.stuck": "0.5 ms"}, "guard.stuck", "timing.period (1 ms)"),
    ({"guard.window": "0.5 ms"}, "guard.window", "timing.period (1 ms)"),
]


@pytest.mark.parametrize(("changes", "path", "words"), CASES)
def test_it_is_refused(changes, path, words):
    changes = {k: f"{v} kg*m^2" if v == 0 else v for k, v in changes.items()}
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert error.value.where.endswith(path)
    assert words in error.value.accepted


@pytest.mark.parametrize(
    "changes",
    [
        {"friction.coulomb": "9.9 N"},  # 70 % of 15.1 N are 10.57 N; 0.6 N break away
        {"arrival.tolerance": "12.6 um"},
        {"encoder.bits": 16},
        {"timing.delay": "1 ms"},
        {"drive.frequency": "99 Hz"},
        {"controller.velocity": "54 V*s/m"},
        {"guard.silent": "1 ms"},
        {"motion.acceleration": "21.3 m/s^2"},
    ],
)
def test_what_is_just_possible_is_not(changes):
    DEFAULT.with_(changes)
