"""What `identify drive` tells of its parameters."""

from __future__ import annotations

import dataclasses
import math

import pytest
from tests.identify.kinds.fits import AXIS, NAMES, STD, fit

from macromicro.identify._ripple import Ripple
from macromicro.identify.kinds import drive_words


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
    assert drive_words.units_of(force, x) == {
        "mass": mass, "viscous": slope, "coulomb": force, "offset": force,
        "asymmetry": slope, "stribeck": force, "stribeck_speed": speed,
        "unbalance": force, "hangs": x,
    }  # fmt: skip


def test_the_structure_in_words() -> None:
    one = dataclasses.replace(fit(AXIS, NAMES, STD), holdout={}, structure="full")
    assert drive_words.structure(one) == "full, as given"
    why = {"viscous": "coulomb is better", "full": "the mass or a friction is negative"}
    many = dataclasses.replace(one, holdout={"viscous": 0.5, "coulomb": 0.25}, reasons=why)
    assert drive_words.structure(dataclasses.replace(many, structure="coulomb")) == (
        "force error on held-out data: coulomb 0.25, taken; viscous 0.5: coulomb is better; "
        "full: the mass or a friction is negative"
    )


def test_a_force_that_repeats_is_told_with_its_period() -> None:
    assert drive_words.repeated(None, "N", "m") == []
    ((name, text),) = drive_words.repeated(Ripple(2.0 * math.pi / 0.065, 1.5, 1.5, 0.0), "N", "m")
    assert name == "repeats" and text.startswith("a force of 1.5 N repeats every 0.065 m; ")
