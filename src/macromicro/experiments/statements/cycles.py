"""Claims A1 to A6: cycle testing of the actuator (Appendix D)."""

from __future__ import annotations

from macromicro.experiments.claim import CALIBRATED, PREDICTED
from macromicro.experiments.statements.statement import Statement

STATEMENTS = (
    Statement(
        "A1",
        "Appendix D",
        "Rise time from the step to 149 of 150 counts falls over the cycles and settles "
        "(under 2 % of change over the last ten)",
        0.23,
        "s",
        CALIBRATED,
    ),
    Statement(
        "A2",
        "Appendix D",
        "Rise time from 0 to 149 counts settles (under 2 % of change over the last ten cycles)",
        0.18,
        "s",
        CALIBRATED,
    ),
    Statement(
        "A3",
        "Appendix D",
        "Fall time from 150 to 0 counts grows over the cycles and settles (under 2 % of "
        "change over the last ten)",
        1.2,
        "s",
        CALIBRATED,
    ),
    Statement(
        "A4",
        "Appendix D",
        "tau1 - tau2, the delay before the actuator answers, stays above zero",
        None,
        "s",
        CALIBRATED,
        "above 0",
    ),
    Statement(
        "A5",
        "Appendix D",
        "The share of samples at 150 counts grows over the cycles as a whole (lines through all "
        "of them rise, the last ten are above the first ten; not from each cycle to the next), "
        "and is higher late in the hold",
        None,
        "%",
        PREDICTED,
        "grows; slightly higher in the second half",
    ),
    Statement(
        "A6",
        "Appendix D",
        "Rise and fall together take longer over the cycles, but not from run to run",
        None,
        "s, s, ms a run",
        PREDICTED,
        "grows; no trend",
    ),
)
