"""Which gains are searched, and between which bounds."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control.settings import Control
from macromicro.design.margins import PdTaps
from macromicro.errors import InputError
from macromicro.schema.par import entries
from macromicro.settings import Settings
from macromicro.tuning import _laws

EVERY = [(stage, name) for stage in ("macro", "micro") for name in _laws.names(stage)]


@pytest.mark.parametrize(("stage", "name"), EVERY)
def test_the_present_gains_are_a_design(stage: str, name: str) -> None:
    """Every law; (4.9) alone lags a little, which no derivative time from 0 on gives."""
    law = _laws.find(stage, name, Control())
    again = law.decoded(law.present()[None, :])[0]
    expected = _laws.gains_of(Control(), law)
    if name == "pd-initial":
        expected = np.array([expected.sum(), 0.0])
    np.testing.assert_allclose(again, expected, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(("stage", "name"), EVERY)
def test_the_search_stays_within_the_bounds(stage: str, name: str) -> None:
    """Corners of the cube are gains that the settings accept."""
    law = _laws.find(stage, name, Control())
    known = {e.path: e.par for e in entries(Settings())}
    for corner in (0.0, 1.0):
        gains = law.decoded(np.full((1, len(law.knobs)), corner))[0]
        for path, value in zip(law.paths, gains, strict=True):
            assert known[path].lo <= value <= known[path].hi


def test_which_gains() -> None:
    """The limits of the effort, and gains that a law does not have, are left alone."""
    found = {name: _laws.find(stage, name, Control()).gains for stage, name in EVERY}
    assert found == {
        "pid": ("kp", "ki", "kd"),
        "pd-initial": ("now", "before"),
        "pd-tuned": ("now", "before"),
        "p": ("kp",),
        "pi": ("kp", "ki"),
        "pi-antiwindup": ("kp", "ki", "kaw"),
    }


def test_a_pd_is_searched_by_gain_and_derivative_time() -> None:
    law = _laws.find("macro", "pd-tuned", Control())
    taps = PdTaps(*law.decoded(np.array([[0.25, 0.5]]))[0])
    assert taps.proportional == pytest.approx(0.1 * 100.0**0.25 * (0.0124593 - 0.0112178))
    assert taps.derivative_time(1e-3) == pytest.approx(0.025)


def test_gains_go_into_the_settings() -> None:
    law = _laws.find("micro", "pi", Control())
    changed = _laws.with_gains(Control(), law, np.array([4.0, 5.0]))
    assert changed.micro_law == "pi"
    assert changed.pi == Control().pi._replace(kp=4.0, ki=5.0)
    assert changed._replace(micro_law=Control().micro_law, pi=Control().pi) == Control()


def test_the_law_of_the_settings_is_the_default() -> None:
    assert _laws.find("macro", None, Control(macro_law="pid")).name == "pid"


@pytest.mark.parametrize(("stage", "name"), [("macro", "pi"), ("micro", "pd-tuned"), ("macro", "")])
def test_an_unknown_law(stage: str, name: str) -> None:
    with pytest.raises(InputError, match="--law"):
        _laws.find(stage, name, Control())
