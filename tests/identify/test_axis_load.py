"""An eccentric load that nobody spoke of: section "An eccentric load" of docs/identify.md."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest

from macromicro.identify import drive, simulate
from macromicro.identify._axis_load import suspected
from macromicro.identify.axis import Axis
from macromicro.identify.axis_fit import rows_of, runs_of
from macromicro.identify.driven import Driven
from macromicro.identify.notices import DataWarning

DT = 1e-3
BALANCED = Axis(mass=0.01, viscous=0.08, coulomb=0.05, offset=0.01)
HUNG = BALANCED._replace(sine=0.06, cosine=-0.08)


def record(axis: Axis, seed: int = 1, n: int = 8000) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Torques of both signs for 0.1 to 0.5 s, a disturbing one, and the angle."""
    random = np.random.default_rng(seed)
    parts: list[np.ndarray] = []
    while sum(map(len, parts)) < n:
        parts.append(np.full(int(random.integers(100, 500)), random.uniform(-1.0, 1.0)))
    u = np.concatenate(parts)[:n]
    x = simulate(axis, u + 0.1 * random.standard_normal(n), DT, random.uniform(-math.pi, math.pi))
    return np.arange(n) * DT, u, np.asarray(x)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_it_shows_in_blocks_held_out_where_it_is(seed: int) -> None:
    for axis, shows in ((HUNG, True), (BALANCED, False)):
        rows = rows_of(runs_of(*record(axis, seed)), Driven())
        assert (suspected(rows, "coulomb") is not None) is shows


def test_what_it_explains_is_a_part_of_the_force_error() -> None:
    rows = rows_of(runs_of(*record(HUNG)), Driven())
    lowered = suspected(rows, "coulomb")
    assert lowered is not None and 0.02 < lowered < 1.0
    heavier = rows_of(runs_of(*record(HUNG._replace(sine=0.12, cosine=-0.16))), Driven())
    more = suspected(heavier, "coulomb")
    assert more is not None and more > lowered


def test_an_angle_alone_is_said_to_hide_a_load() -> None:
    with pytest.warns(DataWarning, match=r"sine of the angle.*--eccentric"):
        drive(*record(HUNG), structure="coulomb", eccentric=None)


@pytest.mark.parametrize(("axis", "eccentric"), [(HUNG, True), (HUNG, False), (BALANCED, None)])
def test_nothing_is_said_where_it_is_known_or_not_there(axis: Axis, eccentric: bool | None) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = drive(*record(axis), structure="coulomb", eccentric=eccentric)
    assert ("sine" in found.refined.names) is bool(eccentric)
