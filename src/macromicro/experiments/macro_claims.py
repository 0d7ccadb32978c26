"""Claims M1 to M6: friction and open-loop identification of the macro-stage (Section 4.2)."""

from __future__ import annotations

import numpy as np

from macromicro.experiments.claim import CALIBRATED, Claim, holds, within
from macromicro.experiments.macro_identification import MacroModel
from macromicro.identify.deadzone import DeadZone

_FROM = "follows from the parameters that were chosen for M3 and M4a"


def friction(zone: DeadZone) -> Claim:
    """M1 from the runs at low voltages."""
    spread = max(float(np.ptp(zone.thresholds(way)[1])) for way in (1, -1))
    verdict = within(zone.width, 2.85, 3.15) if spread > 0.0 else holds(False)
    return Claim(
        "M1",
        "4.2.3",
        "Lowest voltage that moves the carriage without a pause from any place to the end of "
        "its way; below it, motion depends on the place",
        3.0,
        zone.width,
        "V",
        verdict,
        f"voltages in steps of 0.05 V; the least that moves on differs by up to {spread:.2f} V "
        "between starting places",
        CALIBRATED,
    )


def identification(found: MacroModel) -> list[Claim]:
    """M2 to M6 from the averaged steps beyond the dead zone."""
    return [*_speeds(found), *_linear(found), *_jump(found)]


def _speeds(found: MacroModel) -> list[Claim]:
    rows = (
        ("M2", 0.1, 1700.0, 0.04, "Steady speed at 0.1 V beyond the dead zone", ""),
        ("M3", 1.0, 3977.0, 0.04, "Steady speed at 1 V beyond the dead zone", ""),
        (
            "M3b",
            2.0,
            6507.0,
            0.06,
            "Steady speed at 2 V beyond the dead zone, against the line through 0.1 V and 1 V",
            f"that line, fitted here, predicts {found.zone.speed(2.0):.0f} counts/s",
        ),
    )
    return [
        Claim(
            name,
            "4.2.5",
            text,
            printed,
            found.speeds[volts],
            "counts/s",
            within(found.speeds[volts], printed * (1.0 - share), printed * (1.0 + share)),
            reason,
            CALIBRATED,
            "similar" if name == "M3b" else "",
        )
        for name, volts, printed, share, text, reason in rows
    ]


def _linear(found: MacroModel) -> list[Claim]:
    a, b, gain = float(found.linear.a[0]), float(found.linear.b[0]), found.linear.gain
    den, num = found.linear.with_integrator()
    pole = within(a, -0.96233, -0.95433)
    good = abs(b / 165.72 - 1.0) <= 0.08 and abs(gain / 3977.0 - 1.0) <= 0.03
    size = within(b, 165.72 * 0.92, 165.72 * 1.08) if good else holds(False)
    return [
        Claim(
            "M4a",
            "4.2.5",
            "Coefficient a of the speed model b/(z + a) at 1 kHz, by MLS from averaged 1 V steps",
            -0.95833,
            a,
            "",
            pole,
            "(4.3) prints a without its minus sign; the pole is z = -a",
            CALIBRATED,
        ),
        Claim(
            "M4b",
            "4.2.5",
            "Coefficient b of the speed model b/(z + a) at 1 kHz",
            165.72,
            b,
            "counts/s/V",
            size,
            f"{_FROM}; b/(1 + a) = {gain:.0f} counts/s/V against 3977",
            CALIBRATED,
        ),
        Claim(
            "M5",
            "(4.4)",
            "Position model: numerator, then the denominator's last two coefficients",
            [0.16572, -1.95833, 0.95833],
            [float(num[0]), float(den[0]), float(den[1])],
            "",
            holds(pole == size == "reproduced"),
            "the same figures as M4, times the integrator",
            CALIBRATED,
        ),
    ]


def _jump(found: MacroModel) -> list[Claim]:
    side = found.zone.both
    apart = abs(found.zone.positive.a0 - found.zone.negative.a0)
    return [
        Claim(
            "M6a",
            "(4.7)-(4.8)",
            "Threshold output a0 of the dead zone with a jump",
            0.364,
            side.a0,
            "V",
            within(side.a0, 0.334, 0.394),
            f"both directions together; they differ by {apart:.3f} V",
            CALIBRATED,
        ),
        Claim(
            "M6b",
            "(4.7)-(4.8)",
            "Slope delta of the dead zone with a jump",
            0.636,
            side.delta,
            "",
            within(side.delta, 0.606, 0.666),
            "",
            CALIBRATED,
        ),
    ]
