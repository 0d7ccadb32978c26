"""Which gains of the two-stage machine are searched, and between which bounds."""

from __future__ import annotations

import pytest

from macromicro.control.macro import NAMES
from macromicro.control.settings import MICRO_LAWS, Control
from macromicro.design.margins import PdTaps
from macromicro.errors import InputError
from macromicro.schema.par import entries, value_at
from macromicro.settings import Settings
from macromicro.tuning import gains

EVERY = [("macro", name) for name in NAMES] + [("micro", name) for name in MICRO_LAWS]


def values(control: Control, law: gains.Law) -> list[float]:
    return [value_at(Settings(controller=control), path) for path in law.paths]


@pytest.mark.parametrize(("stage", "name"), EVERY)
def test_the_present_gains_are_a_design(stage: str, name: str) -> None:
    """Every law, to eight digits; (4.9) alone lags a little, which no derivative time gives."""
    law = gains.find(stage, name, Control())
    again = law.applied(Control(), [knob.at(knob.share) for knob in law.knobs(Control())])
    expected = values(Control(), law)
    if name == "pd-initial":
        expected = [sum(expected), 0.0]
    assert values(again, law) == pytest.approx(expected, rel=1e-7, abs=1e-18)


@pytest.mark.parametrize(("stage", "name"), EVERY)
@pytest.mark.parametrize("corner", [0.0, 1.0])
def test_the_search_stays_within_the_bounds(stage: str, name: str, corner: float) -> None:
    """Corners of the cube are gains that the settings accept."""
    law = gains.find(stage, name, Control())
    known = {e.path: e.par for e in entries(Settings())}
    found = law.applied(Control(), [knob.at(corner) for knob in law.knobs(Control())])
    for path, value in zip(law.paths, values(found, law), strict=True):
        assert known[path].lo <= value <= known[path].hi


def test_which_gains() -> None:
    """The limits of the effort, and gains that a law does not have, are left alone."""
    found = {name: gains.find(stage, name, Control()).gains for stage, name in EVERY}
    assert {name: tuple(gain.path for gain in law) for name, law in found.items()} == {
        "pid": ("kp", "ki", "kd"),
        "pd-initial": ("now", "before"),
        "pd-tuned": ("now", "before"),
        "p": ("kp",),
        "pi": ("kp", "ki"),
        "pi-antiwindup": ("kp", "ki", "kaw"),
    }


def test_a_pd_is_searched_by_gain_and_derivative_time() -> None:
    law = gains.find("macro", "pd-tuned", Control())
    static, derivative = law.knobs(Control())
    found = law.applied(Control(), [static.at(0.25), derivative.at(0.5)])
    taps = PdTaps(*found.pd_tuned)
    assert taps.proportional == pytest.approx(0.1 * 100.0**0.25 * (0.0124593 - 0.0112178), rel=1e-5)
    assert taps.derivative_time(1e-3) == pytest.approx(0.025, rel=1e-5)


@pytest.mark.parametrize("name", ["pid", "pd-tuned", "pi-antiwindup"])
def test_gains_are_rounded_as_they_are_written(name: str) -> None:
    """To eight digits in the units that a user reads."""
    law = gains.find({n: s for s, n in EVERY}[name], name, Control())
    found = law.applied(Control(), [knob.at(0.377) for knob in law.knobs(Control())])
    for gain, stored in zip(law.gains, values(found, law), strict=True):
        shown = gain.par.given(stored)
        assert shown == pytest.approx(float(f"{shown:.8g}"), rel=1e-14, abs=0.0)


def test_only_the_gains_change() -> None:
    law = gains.find("micro", "pi", Control())
    changed = law.with_gains(law.under(Control()), [4.0, 5.0])
    assert changed.micro_law == "pi"
    assert changed.pi == Control().pi._replace(kp=4.0, ki=5.0)
    assert changed._replace(micro_law=Control().micro_law, pi=Control().pi) == Control()


def test_the_law_of_the_settings_is_the_default() -> None:
    assert gains.find("macro", None, Control(macro_law="pid")).name == "pid"


@pytest.mark.parametrize(("stage", "name"), [("macro", "pi"), ("micro", "pd-tuned"), ("macro", "")])
def test_an_unknown_law(stage: str, name: str) -> None:
    with pytest.raises(InputError, match="--law"):
        gains.find(stage, name, Control())
