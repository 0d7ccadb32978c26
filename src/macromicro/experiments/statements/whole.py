"""Claims I1 to I7: the integrated system (Chapters 6 and 7)."""

from __future__ import annotations

from macromicro.experiments.claim import CALIBRATED, PREDICTED, SET
from macromicro.experiments.statements.statement import Statement

STATEMENTS = (
    Statement(
        "I1",
        "6.1",
        "The macro-stage moves, two seconds pass, the laser is reset, the micro-stage runs",
        None,
        "s",
        SET,
        "a wait of 2 s",
    ),
    Statement(
        "I2",
        "6.2",
        "A macro move leaves a vibration that has gone after about two seconds",
        [20.0, 2.0],
        "um, s",
        CALIBRATED,
        "20 um; 2 s",
    ),
    Statement(
        "I3",
        "6.3",
        "After ten cycles the stage extends more slowly and seems to miss its set point",
        None,
        "%, um",
        CALIBRATED,
        "visibly slower, a bias",
    ),
    Statement(
        "I4",
        "6.3.1",
        "With a fan the return takes about a second after ten cycles, and the bias is gone",
        1.0,
        "s",
        CALIBRATED,
    ),
    Statement(
        "I5",
        "6.4.1",
        "The laser's noise with the system at rest",
        2.0,
        "um",
        CALIBRATED,
    ),
    Statement(
        "I6",
        "6.4.2",
        "The micro-stage's cycle with a fan takes about two seconds",
        2.0,
        "s",
        PREDICTED,
    ),
    Statement(
        "I7",
        "7",
        "Best accuracy that feedback by the laser can reach, with the integral gain that serves it",
        2.0,
        "um",
        CALIBRATED,
    ),
)
