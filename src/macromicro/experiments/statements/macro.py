"""Claims M1 to M16: the macro-stage (Chapter 4 and Section 6.4.2)."""

from __future__ import annotations

from macromicro.experiments.claim import CALIBRATED, COMPUTED, PREDICTED
from macromicro.experiments.statements.statement import Statement

STATEMENTS = (
    Statement(
        "M1",
        "4.2.3",
        "Lowest voltage that moves the carriage without a pause from any place to the end"
        " of its way; below it, motion depends on the place",
        3.0,
        "V",
        CALIBRATED,
    ),
    Statement(
        "M2",
        "4.2.5",
        "Steady speed at 0.1 V beyond the dead zone",
        1700.0,
        "counts/s",
        CALIBRATED,
    ),
    Statement(
        "M3",
        "4.2.5",
        "Steady speed at 1 V beyond the dead zone",
        3977.0,
        "counts/s",
        CALIBRATED,
    ),
    Statement(
        "M3b",
        "4.2.5",
        "Steady speed at 2 V beyond the dead zone, against the line through 0.1 V and 1 V",
        6507.0,
        "counts/s",
        CALIBRATED,
        "similar",
    ),
    Statement(
        "M4a",
        "4.2.5",
        "Coefficient a of the speed model b/(z + a) at 1 kHz, by MLS from averaged 1 V steps",
        -0.95833,
        "",
        CALIBRATED,
    ),
    Statement(
        "M4b",
        "4.2.5",
        "Coefficient b of the speed model b/(z + a) at 1 kHz",
        165.72,
        "counts/s/V",
        CALIBRATED,
    ),
    Statement(
        "M5",
        "(4.4)",
        "Position model: numerator, then the denominator's last two coefficients",
        [0.16572, -1.95833, 0.95833],
        "",
        CALIBRATED,
    ),
    Statement(
        "M6a",
        "(4.7)-(4.8)",
        "Threshold output a0 of the dead zone with a jump",
        0.364,
        "V",
        CALIBRATED,
    ),
    Statement(
        "M6b",
        "(4.7)-(4.8)",
        "Slope delta of the dead zone with a jump",
        0.636,
        "",
        CALIBRATED,
    ),
    Statement(
        "M7",
        "Fig 4.13",
        "The initial model's steady speed is right at 1 V and wrong at 0.1 V and 2 V",
        None,
        "counts/s",
        PREDICTED,
        "closely matches the 1 V square wave, diverges otherwise",
    ),
    Statement(
        "M8",
        "Fig 4.17",
        "The tuned model's position fits square and sine inputs of 0.1, 1 and 2 V",
        None,
        "%",
        PREDICTED,
        "much improved, more closely match",
    ),
    Statement(
        "M9",
        "4.3.1",
        "Benchmark PID, 2800-count step: a fast rise (0-98 %), then stiction while the "
        "effort ramps, until it turns the carriage back",
        0.7,
        "s",
        PREDICTED,
    ),
    Statement(
        "M10",
        "Fig 4.20",
        "Initial PD: the bench overshoots (counts) and chatters (reversals of the "
        "position after arrival), its own simulation does neither",
        None,
        "counts, 1",
        CALIBRATED,
        "overshoot and chatter",
    ),
    Statement(
        "M11",
        "4.3.3",
        "Gain crossover of the tuned PD (4.10) with the position model (4.4)",
        4.91,
        "rad/s",
        COMPUTED,
    ),
    Statement(
        "M11b",
        "4.3.2",
        "Phase margin and gain crossover of the initial PD (4.9) with (4.4)",
        [76.3, 9.91],
        "deg, rad/s",
        COMPUTED,
        "damping ratio 1",
    ),
    Statement(
        "M12",
        "4.3.3",
        "Tuning in simulation for a 3000-count step, judged by a stated rule: its gain "
        "neither overshoots nor saturates beyond the first sample. Measured are the "
        "damping ratio whose effort just reaches the limit, which is for comparison, and "
        "the rule's overshoot and saturated samples; (4.10) does not follow from the "
        "printed ratio",
        1.05,
        "ratio, counts, samples",
        PREDICTED,
    ),
    Statement(
        "M13",
        "Fig 4.24",
        "Tuned PD on a decaying square: simulation and bench agree (RMS error over the "
        "range), the bench does not oscillate",
        None,
        "%",
        PREDICTED,
        "match extremely well",
    ),
    Statement(
        "M14",
        "6.4.2",
        "Move over the full travel in closed loop, to within 2 %",
        0.75,
        "s",
        PREDICTED,
    ),
    Statement(
        "M15",
        "Fig 4.25",
        "Order of the three controllers: settled error of tuned PD, initial PD, PID",
        None,
        "counts",
        PREDICTED,
        "tuned > initial > PID",
    ),
    Statement(
        "M16",
        "4",
        "Encoder counts in 200 mm of travel, the length by the laser",
        2800.0,
        "counts",
        CALIBRATED,
        "2800-3000",
    ),
)
