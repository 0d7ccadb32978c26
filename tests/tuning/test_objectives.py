"""The costs are the formulas that are written down."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.tuning import _objectives
from macromicro.tuning._objectives import FAILED, Scale, costs, find

NAN = float("nan")
SCALE = Scale(10.0, 2800.0, 0.5)


def macro(**changed: float) -> dict[str, np.ndarray]:
    whole = {
        "settling_time": 0.6, "overshoot": 0.0, "iae": 700.0, "final_error": 0.0,
        "peak_effort": 4.0, "saturated": 0.0,
    }  # fmt: skip
    return {k: np.array([v]) for k, v in {**whole, **changed}.items()}


def micro(**changed: float) -> dict[str, np.ndarray]:
    whole = {
        "settle_up": 0.5, "settle_down": 1.0, "overshoot": 3.0, "worst_error": 2.0, "iae": 1.5,
        "saturated": 0.25,
    }  # fmt: skip
    return {k: np.array([v]) for k, v in {**whole, **changed}.items()}


@pytest.mark.parametrize(
    ("name", "changed", "cost"),
    [
        ("settling", {}, 0.6),
        ("settling", {"overshoot": 0.4}, 0.6),
        ("settling", {"overshoot": 3.0}, 0.6 + 2.5),
        ("settling", {"saturated": 50.0}, 0.6),
        ("settling", {"settling_time": NAN, "final_error": -280.0}, 11.0),
        ("iae", {"overshoot": 1.0}, 0.25 + 0.5),
        ("effort", {"settling_time": 0.4}, 4.0),
        ("effort", {}, 4.0 + 10.0 * 0.2),
        ("iae", {"iae": NAN}, FAILED),
    ],
)
def test_macro(name: str, changed: dict[str, float], cost: float) -> None:
    assert costs(find("macro", name), macro(**changed), SCALE)[0] == pytest.approx(cost)


@pytest.mark.parametrize(
    ("name", "changed", "cost"),
    [
        ("settling", {}, 1.5),
        ("settling", {"settle_down": NAN}, 4.5),
        ("settling", {"overshoot": 30.0}, 1.5 + 1.0),
        ("settling", {"worst_error": 9.0}, 1.5 + 0.2),
        ("iae", {}, 1.5),
        ("effort", {}, 0.25 + 10.0 * 2.0),
    ],
)
def test_micro(name: str, changed: dict[str, float], cost: float) -> None:
    assert costs(find("micro", name), micro(**changed), SCALE)[0] == pytest.approx(cost)


def test_penalties_have_the_weights_that_are_asked_for() -> None:
    settling = find("macro", "settling")
    strict = SCALE._replace(weights=_objectives.penalties(settling, {"saturated": 0.01}))
    assert costs(settling, macro(saturated=50.0), strict)[0] == pytest.approx(0.6 + 0.5)
    free = SCALE._replace(weights=_objectives.penalties(settling, {"overshoot": 0.0}))
    assert costs(settling, macro(overshoot=300.0), free)[0] == pytest.approx(0.6)
    assert _objectives.values(settling, macro(overshoot=300.0), SCALE)[0] == pytest.approx(0.6)


def test_many_at_once() -> None:
    """(designs, benches) of metrics give as many costs, each bench with its own T0."""
    metrics = {k: np.repeat(v[:, None], 2, axis=1) for k, v in macro().items()}
    found = costs(find("macro", "effort"), metrics, SCALE._replace(time=np.array([0.6, 0.3])))
    np.testing.assert_allclose(found, [[4.0, 14.0]])


def test_an_unknown_objective() -> None:
    with pytest.raises(InputError, match=r"--objective.*settling, iae, effort"):
        find("micro", "speed")
    assert {len(o) for o in _objectives.OBJECTIVES.values()} == {3}
