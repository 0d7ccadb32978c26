"""What `identify drive` tells of its parameters."""

from __future__ import annotations

import math

import pytest

from macromicro.identify._disturbances import Ripple
from macromicro.identify.kinds import drive_report


@pytest.mark.parametrize(
    ("force", "x", "mass", "slope", "speed"),
    [
        ("N", "m", "kg", "N*s/m", "m/s"),
        ("V", "m", "V*s^2/m", "V*s/m", "m/s"),
        ("N", "rad", "N*s^2/rad", "N*s/rad", "rad/s"),
        ("V", "counts", "V*s^2/counts", "V*s/counts", "counts/s"),
    ],
)
def test_units_of_the_parameters(force: str, x: str, mass: str, slope: str, speed: str) -> None:
    units = drive_report.units_of(force, x, "V")
    known = {
        "mass": mass, "viscous": slope, "coulomb": force, "offset": force,
        "asymmetry": slope, "stribeck": force, "stribeck_speed": speed,
        "unbalance": force, "hangs": x, "dead_zone": "V", "rest": x, "spring": f"{force}/{x}",
    }  # fmt: skip
    assert {name: units[name] for name in known} == known
    free = drive_report.units_of(force, x, driven=False)
    assert (free["viscous"], free["coulomb"], free["spring"]) == ("1/s", f"{x}/s^2", "1/s^2")


def test_the_structure_in_words() -> None:
    assert drive_report.structure("head", "full", {}, {}, math.inf) == "full, as given"
    why = {"viscous": "coulomb is better", "full": "the mass or a friction is negative"}
    tried = {"viscous": 0.5, "coulomb": 0.25}
    assert drive_report.structure("error", "coulomb", tried, why, math.inf) == (
        "error: coulomb 0.25, taken; viscous 0.5: coulomb is better; "
        "full: the mass or a friction is negative"
    )
    words = drive_report.structure("error", "coulomb", {"viscous": 3e15, "coulomb": 0.25}, {}, 1.0)
    assert words == "error: coulomb 0.25, taken; viscous diverges"


def test_a_force_that_repeats_is_told_with_its_period() -> None:
    assert drive_report.ripple_lines(None, "N", "m") == []
    ((name, text),) = drive_report.ripple_lines(
        Ripple(2.0 * math.pi / 0.065, 1.5, 1.5, 0.0), "N", "m"
    )
    assert name == "repeats" and text.startswith("a force of 1.5 N repeats every 0.065 m; ")
