"""Claims D1 to D11: design of the micro-stage, its sensor and its costs (Chapters 3 and 6)."""

from __future__ import annotations

from macromicro.experiments.claim import CALIBRATED, COMPUTED
from macromicro.experiments.statements.statement import Statement

STATEMENTS = (
    Statement(
        "D1",
        "3.2.2",
        "greatest thickness of a flexure beam by (3.1), for 17.5 gf at 2 mm",
        0.465,
        "mm",
        COMPUTED,
    ),
    Statement(
        "D2",
        "3.2.3",
        "step of a 12-bit converter over 0-5 V",
        1.22,
        "mV/bit",
        COMPUTED,
    ),
    Statement(
        "D3",
        "3.2.3",
        "field worth one bit at 3.125 mV/G",
        0.3904,
        "G/bit",
        COMPUTED,
    ),
    Statement(
        "D4",
        "3.2.3",
        "travel per gauss where the flux changes by 5000 G/in",
        5.0,
        "um/G",
        COMPUTED,
    ),
    Statement(
        "D5",
        "3.2.3",
        "travel worth one bit at the ends, predicted",
        1.952,
        "um/bit",
        COMPUTED,
    ),
    Statement(
        "D6",
        "3.2.3",
        "travel worth one bit after calibration against the laser",
        0.976,
        "um/bit",
        CALIBRATED,
    ),
    Statement(
        "D7",
        "Table 3.1",
        "largest change of flux over 1 mm for seven magnets; the 103MG5 changes most",
        [460.0, 305.0, 144.0, 146.0, 167.0, 122.0, 213.0],
        "G",
        COMPUTED,
        "103MG5 chosen",
    ),
    Statement(
        "D8",
        "Table 3.2",
        "Hall sensors with a range over 650 G and the sensitivity of D11",
        ["SS495A", "SS495A1", "SS495A2", "SS94B1", "90215"],
        "",
        COMPUTED,
        "SS94B1 chosen",
    ),
    Statement(
        "D9",
        "Table 6.1",
        "cost of the micro-stage, its six parts summed",
        255.0,
        "USD",
        COMPUTED,
    ),
    Statement(
        "D10",
        "Table 6.2",
        "cost against four other technologies",
        [255.0, 1500.0, 4000.0, 4000.0, 8000.0],
        "USD",
        COMPUTED,
    ),
    Statement(
        "D11",
        "3.2.3",
        "least sensitivity: 4 V of output over +-650 G",
        3.0,
        "mV/G",
        COMPUTED,
    ),
)
