"""Claims M1 to M6: friction and open-loop identification of the macro-stage (Section 4.2)."""

from __future__ import annotations

import numpy as np

from macromicro.experiments.claim import Claim, holds, within
from macromicro.experiments.macro_identification import MacroModel
from macromicro.experiments.statements import stated
from macromicro.identify.deadzone import DeadZone

_FROM = "follows from the parameters that were chosen for M3 and M4a"


def friction(zone: DeadZone) -> Claim:
    """M1 from the runs at low voltages."""
    spread = max(float(np.ptp(zone.thresholds(way)[1])) for way in (1, -1))
    verdict = within(zone.width, 2.85, 3.15) if spread > 0.0 else holds(False)
    return stated(
        "M1",
        zone.width,
        verdict,
        f"voltages in steps of 0.05 V; the least that moves on differs by up to {spread:.2f} V "
        "between starting places",
    )


def identification(found: MacroModel) -> list[Claim]:
    """M2 to M6 from the averaged steps beyond the dead zone."""
    return [*_speeds(found), *_linear(found), *_jump(found)]


def _speeds(found: MacroModel) -> list[Claim]:
    rows = (
        ("M2", 0.1, 1700.0, 0.04, ""),
        ("M3", 1.0, 3977.0, 0.04, ""),
        (
            "M3b",
            2.0,
            6507.0,
            0.06,
            f"that line, fitted here, predicts {found.zone.speed(2.0):.0f} counts/s",
        ),
    )
    return [
        stated(
            name,
            found.speeds[volts],
            within(found.speeds[volts], printed * (1.0 - share), printed * (1.0 + share)),
            reason,
        )
        for name, volts, printed, share, reason in rows
    ]


def _linear(found: MacroModel) -> list[Claim]:
    a, b, gain = float(found.linear.a[0]), float(found.linear.b[0]), found.linear.gain
    den, num = found.linear.with_integrator()
    pole = within(a, -0.96233, -0.95433)
    good = abs(b / 165.72 - 1.0) <= 0.08 and abs(gain / 3977.0 - 1.0) <= 0.03
    size = within(b, 165.72 * 0.92, 165.72 * 1.08) if good else holds(False)
    return [
        stated("M4a", a, pole, "(4.3) prints a without its minus sign; the pole is z = -a"),
        stated("M4b", b, size, f"{_FROM}; b/(1 + a) = {gain:.0f} counts/s/V against 3977"),
        stated(
            "M5",
            [float(num[0]), float(den[0]), float(den[1])],
            holds(pole == size == "reproduced"),
            "the same figures as M4, times the integrator",
        ),
    ]


def _jump(found: MacroModel) -> list[Claim]:
    side = found.zone.both
    apart = abs(found.zone.positive.a0 - found.zone.negative.a0)
    return [
        stated(
            "M6a",
            side.a0,
            within(side.a0, 0.334, 0.394),
            f"both directions together; they differ by {apart:.3f} V",
        ),
        stated("M6b", side.delta, within(side.delta, 0.606, 0.666)),
    ]
