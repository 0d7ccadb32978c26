"""Claims D1-D11 and S9."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.thesis.chapter2 import technologies
from macromicro.thesis.chapter3 import sensor_design
from macromicro.thesis.chapter5 import electrothermal
from macromicro.thesis.claims import COMPUTED, DIFFERS, REPRODUCED, Claim


@pytest.fixture(scope="module")
def found() -> dict[str, Claim]:
    made = [
        *sensor_design.measure(),
        *technologies.measure(),
        *electrothermal.printed_gain(),
    ]
    assert len({c.id for c in made}) == len(made)
    return {c.id: c for c in made}


# Bounds of each row's acceptance, written out.
@pytest.mark.parametrize(
    ("key", "low", "high"),
    [
        ("D1", 0.464665, 0.469335),
        ("D2", 1.2139, 1.2261),
        ("D3", 0.388448, 0.392352),
        ("D4", 4.9, 5.1),
        ("D5", 1.91296, 1.99104),
        ("D9", 255.0, 255.0),
        ("D11", 3.0492, 3.1108),
    ],
)
def test_number_within_its_bounds(
    found: dict[str, Claim], key: str, low: float, high: float
) -> None:
    claim = found[key]
    assert isinstance(claim.measured, float)
    assert low <= claim.measured <= high
    assert claim.verdict == REPRODUCED
    assert claim.kind == COMPUTED


def test_d7_differs_in_one_magnet(found: dict[str, Claim]) -> None:
    """Table 3.1: 101MG7 changes by 184 G, 122 is printed; the others within 2 %."""
    claim = found["D7"]
    assert isinstance(claim.measured, list) and isinstance(claim.printed, list)
    ratio = np.array(claim.measured) / np.array(claim.printed)
    assert [bool(r) for r in np.abs(ratio - 1) > 0.02] == [False] * 5 + [True, False]
    assert claim.verdict == DIFFERS
    assert "101MG7 184 G against 122 G" in claim.reason


@pytest.mark.parametrize("key", ["D8", "D10", "S9"])
def test_set_and_lists(found: dict[str, Claim], key: str) -> None:
    assert found[key].verdict == REPRODUCED


def test_d10_carries_the_contradiction(found: dict[str, Claim]) -> None:
    assert found["D10"].measured == [255.0, 1500.0, 4000.0, 4000.0, 8000.0]
    assert "1500-5000 USD in Table 2.1, 1500 USD in Table 6.2" in found["D10"].reason
    assert "3000 USD in Table 2.1, 4000 USD in Table 6.2" in found["D10"].reason


def test_d8_names_the_sensors(found: dict[str, Claim]) -> None:
    """Table 3.2: the exact set, and which of them are cheap."""
    claim = found["D8"]
    assert isinstance(claim.measured, list) and isinstance(claim.printed, list)
    assert set(claim.printed) == {"SS495A", "SS495A1", "SS495A2", "SS94B1", "90215"}
    assert set(claim.measured) == set(claim.printed)
    assert "Below 100 USD: SS495A SS495A1 SS495A2 SS94B1;" in claim.reason


def test_technology_table() -> None:
    """Table 2.1 with its accuracies, ranges, speeds and loads."""
    rows = technologies.table()
    assert len(rows) == 5
    assert rows[0][0] == "SMA micro-stage" and rows[0][-1] == "255 USD"
    assert rows[1][1:] == (
        "100-1000 nm",
        "below 600 mm",
        "0.1 um/s to 100 mm/s",
        "200 N",
        "1500-5000 USD",
    )
    assert rows[3][1] == "below 1 nm"


def test_gain_curve_is_continuous_and_rises() -> None:
    """Figure 5.14."""
    volts, rise = electrothermal.curve()
    assert volts[0] == 1.4 and volts[-1] == 1.9
    assert (np.diff(rise) >= 0.0).all()
    assert math.isclose(rise[-1], 239.0, abs_tol=0.5)
