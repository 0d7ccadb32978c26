"""The table of uncertain parameters and the sample drawn over it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as budget
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.plant import phase
from macromicro.robustness.sampling import centre, latin_hypercube, settings_at
from macromicro.robustness.uncertain import (
    FACTOR,
    SHIFT,
    UNCERTAIN,
    VALUE,
    Uncertain,
    applied,
    nominal,
    refusal,
)
from macromicro.schema import config
from macromicro.schema.par import entries, replaced
from macromicro.settings import Settings

BASE = Settings()
KNOWN = {e.path: e.value for e in entries(BASE)}
BY_NAME = {u.name: u for u in UNCERTAIN}


def test_table_names_parameters_and_sources() -> None:
    assert len(BY_NAME) == len(UNCERTAIN)
    for u in UNCERTAIN:
        assert u.low < u.high
        assert u.low <= nominal(u, BASE) <= u.high, u.name
        assert u.meaning
        assert u.source
        assert all(isinstance(KNOWN[path], float) for path, _ in u.parts)


def test_no_two_move_the_same_setting() -> None:
    paths = [path for u in UNCERTAIN for path, _ in u.parts]
    assert len(set(paths)) == len(paths)


def test_asked_for_ranges() -> None:
    for name in ("coulomb", "stribeck", "viscous"):
        assert (BY_NAME[name].kind, BY_NAME[name].low, BY_NAME[name].high) == (FACTOR, 0.7, 1.3)
    assert (BY_NAME["ambient"].kind, BY_NAME["ambient"].low, BY_NAME["ambient"].high) == (
        VALUE,
        15.0,
        35.0,
    )


def test_the_centre_changes_nothing() -> None:
    assert settings_at(BASE, UNCERTAIN, centre(BASE, UNCERTAIN)) == BASE


def test_the_three_kinds() -> None:
    path = "bench.friction.coulomb"
    for kind, amount, expected in ((FACTOR, 1.5, 15.0), (SHIFT, 2.0, 11.0), (VALUE, 7.0, 7.0)):
        each = Uncertain("x", ((path, 0.5),), kind, 0.0, 9.0, "", "", "")
        tree = applied(replaced(BASE, path, 10.0), each, amount)
        assert tree.bench.friction.coulomb == expected


@given(st.sampled_from([-10.0, -4.0, 5.0]))
def test_loop_shift_moves_the_density_and_keeps_its_shape(shift: float) -> None:
    """Thresholds `shift` higher have the density that those before had."""
    moved = applied(BASE, BY_NAME["loop_shift"], shift)
    up = np.linspace(45.0, 105.0, 13)[:, None]
    down = np.linspace(37.0, 90.0, 40)[None, :]
    before = phase.weights(BASE.bench.phase, up, down)
    after = phase.weights(moved.bench.phase, up + shift, down + shift)
    assert after == pytest.approx(before, rel=1e-9, abs=1e-15)
    assert before.max() > 0.0


@given(st.integers(10, 60), st.integers(0, 2**40))
@budget(max_examples=10)
def test_every_part_of_every_range_is_used_once(n: int, seed: int) -> None:
    sample = latin_hypercube(BASE, UNCERTAIN, n, seed)
    low, high = (np.array([getattr(u, side) for u in UNCERTAIN]) for side in ("low", "high"))
    cells = np.floor((sample.amounts - low) / (high - low) * n).astype(int)
    assert sample.amounts.shape == (n, len(UNCERTAIN))
    assert sample.refused == 0
    assert (np.sort(cells, axis=0) == np.arange(n)[:, None]).all()


def test_a_seed_repeats_its_sample_and_another_does_not() -> None:
    first, again, other = (latin_hypercube(BASE, UNCERTAIN, 12, s).amounts for s in (3, 3, 4))
    assert (first == again).all()
    assert (first != other).any()


def test_default_sample_is_possible_throughout() -> None:
    sample = latin_hypercube(BASE, UNCERTAIN, 100, 0)
    for amounts in sample.amounts:
        config.check(settings_at(BASE, UNCERTAIN, amounts), "sample")


def test_impossible_machines_are_replaced_and_counted() -> None:
    """A ripple of 9 N needs more kinetic friction than that."""
    base = replaced(BASE, "bench.friction.ripple", 9.0)
    sample = latin_hypercube(base, UNCERTAIN, 40, 0)
    assert len(sample.amounts) == 40
    assert sample.refused > 0
    assert "friction.ripple" in sample.reason
    coulomb = sample.amounts[:, 0] * base.bench.friction.coulomb
    assert (coulomb > 9.0).all()


def test_hopeless_settings_are_refused_in_words() -> None:
    base = replaced(BASE, "bench.friction.ripple", 10.4)
    narrow = (BY_NAME["coulomb"]._replace(high=0.9),)
    with pytest.raises(InputError, match=r"friction\.ripple"):
        latin_hypercube(base, narrow, 10, 0)


def test_refusal_names_bounds() -> None:
    assert refusal(BASE) is None
    words = refusal(replaced(BASE, "bench.belt.frequency", 500.0))
    assert words is not None
    assert "bench.belt.frequency" in words
