"""Margins of the gains that were found: on the model, and on what it may be as well."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.commission import _axis_gains, _settings
from macromicro.commission._axis_fit import FITTED, Level, Model
from macromicro.commission._mode import Mode, Shape
from macromicro.identify import axis_settings
from macromicro.identify.axis_settings import Around
from macromicro.identify.clusters import Spread
from macromicro.machines import loops, sheets
from macromicro.models.mass import Axis

AXIS = Axis(mass=0.4, viscous=6.0, coulomb=0.3, stribeck=0.1, stribeck_speed=0.01, lag=0.6e-3)
AROUND = Around(
    gain=1.0, effort=10.0, pitch=1e-6, period=1e-3, travel=0.1, speed=0.5, ripple=0.0
)  # fmt: skip
NOTHING = np.zeros(1)
SURE = {"resonance": 0.0, "damping": 0.0, "lag": 0.0}


def model(errors: dict[str, float], mode: Mode | None = None) -> Model:
    """What strokes may have shown, with standard errors as parts of the values."""
    off = [errors.get(name, 0.0) * getattr(AXIS, name) for name in FITTED]
    own = Spread(np.diag(np.square(off)), np.zeros((1, 5, 5)))
    level = Level(np.zeros(2), np.zeros(2))
    made = Model(AXIS, level, FITTED, own, np.zeros((5, 5)), 0.0)
    return made.shaken(mode)


def shaken(errors: dict[str, float], at: str = "motor") -> Mode:
    shape = Shape(AXIS.viscous / AXIS.mass, 0.6e-3, 0.0, 60.0, 0.7, 0.03, at)
    return Mode(shape, 2.5, errors, 1.0, (4.0, 400.0), *(NOTHING,) * 4)  # type: ignore[arg-type]


def tree(found: Model) -> Any:
    values = axis_settings.values(found.axis, AROUND)
    if found.limber is not None:
        values = _settings.with_mode(values, found.limber, AROUND.period)
    return _settings.as_file(values)[1]


@pytest.mark.parametrize("mode", [None, shaken(SURE), shaken(SURE, "load")])
def test_they_are_those_of_the_machine_that_was_found(mode: Mode | None) -> None:
    found = model({}, mode)
    made = tree(found)
    frequency = loops.grid(1e-3, 0.01)
    loop = sheets.plant(made, frequency) * loops.law(made.controller, frequency, 1e-3)
    expected = loops.margins(frequency, loop)
    told = _axis_gains.robust(made, found)
    for name in ("crossover", "phase", "gain", "modulus"):
        assert getattr(told.found, name) == pytest.approx(getattr(expected, name), rel=0.05), name
    assert told.stable == _axis_gains.DRAWS
    assert told.least == pytest.approx(told.found, rel=1e-9)  # nothing is uncertain
    assert _axis_gains.robustness(made, found).doubts == ()


def test_what_is_less_sure_leaves_less() -> None:
    made = tree(model({}))
    near, far = (
        _axis_gains.robust(made, model({"mass": off, "lag": off, "viscous": off})).least
        for off in (0.02, 0.2)
    )
    found = _axis_gains.robust(made, model({})).found
    assert far.phase < near.phase < found.phase and far.gain < near.gain < found.gain
    assert far.modulus < near.modulus < found.modulus
    # The mass alone: the gain margin goes with it, by the least of 200 normal draws.
    alone = _axis_gains.robust(made, model({"mass": 0.02})).least
    assert 0.02 * 2.0 < 1.0 - alone.gain / found.gain < 0.02 * 4.5


def test_a_mode_that_is_not_well_known_counts() -> None:
    sure, unsure = (shaken({"resonance": off, "damping": 0.0, "lag": 0.0}) for off in (0.0, 12.0))
    made = tree(model({}, sure))
    known = _axis_gains.robust(made, model({}, sure))
    guessed = _axis_gains.robust(made, model({}, unsure))
    assert guessed.least.modulus < known.least.modulus


def test_gains_that_may_not_hold_are_doubtful() -> None:
    made = tree(model({}))
    wild = made._replace(
        controller=made.controller._replace(velocity=3.0 * made.controller.velocity)
    )
    said = _axis_gains.robustness(wild, model({"lag": 0.2})).doubts
    assert len(said) == 1 and "unstable" in said[0]
    worst = made._replace(
        controller=made.controller._replace(velocity=12.0 * made.controller.velocity)
    )
    assert "of 200 models" in _axis_gains.robustness(worst, model({})).doubts[0]


def test_the_page_has_a_line_each() -> None:
    lines = _axis_gains.robustness(tree(model({})), model({"mass": 0.02})).rows
    assert [line[3] for line in lines] == ["Hz", "deg", "", ""]
    assert all(line[2].startswith(">= ") and not math.isnan(float(line[1])) for line in lines)


def test_what_keeps_away_is_what_the_margins_say() -> None:
    """Whatever the gains are, and on the same machines."""
    found = model({"mass": 0.05, "lag": 0.1, "viscous": 0.05}, shaken(SURE))
    made, answers = tree(found), set()
    each = tuple(_axis_gains.drawn_machines(made, found, 20))
    for factor in (0.3, 1.0, 2.0, 3.0, 12.0):
        faster = made._replace(
            controller=made.controller._replace(velocity=factor * made.controller.velocity)
        )
        told = _axis_gains.robust(faster, found, 20)
        least = told.least.modulus
        for modulus in (least, math.nextafter(least, 9.0), 0.5):
            expected = told.stable == told.drawn and least >= modulus
            assert _axis_gains.keeps(faster, found, each, modulus) == expected
            answers.add(expected)
    assert answers == {False, True}
