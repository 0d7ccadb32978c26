"""Machines drawn from the table."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as budget
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.plant import phase
from macromicro.schema import config
from macromicro.schema.par import replaced
from macromicro.settings import Settings
from macromicro.uncertainty.machines import centre, draw, refusal, settings_at
from macromicro.uncertainty.ranges import FACTOR, SHIFT, VALUE
from macromicro.uncertainty.table import UNCERTAIN, Uncertain

BASE = Settings()
BY_NAME = {u.name: u for u in UNCERTAIN}


def test_the_centre_changes_nothing() -> None:
    assert settings_at(BASE, UNCERTAIN, centre(BASE, UNCERTAIN)) == BASE


def test_the_three_kinds() -> None:
    path = "bench.friction.coulomb"
    for kind, amount, expected in ((FACTOR, 1.5, 15.0), (SHIFT, 2.0, 11.0), (VALUE, 7.0, 7.0)):
        each = Uncertain("x", "macro", ((path, 0.5),), kind, 0.0, 9.0, "", "", "")
        tree = settings_at(replaced(BASE, path, 10.0), [each], np.array([amount]))
        assert tree.bench.friction.coulomb == expected


@given(st.sampled_from([-10.0, -4.0, 5.0]))
def test_loop_shift_moves_the_density_and_keeps_its_shape(shift: float) -> None:
    """Thresholds `shift` higher have the density that those before had."""
    moved = settings_at(BASE, [BY_NAME["loop_shift"]], np.array([shift]))
    up = np.linspace(45.0, 105.0, 13)[:, None]
    down = np.linspace(37.0, 90.0, 40)[None, :]
    before = phase.weights(BASE.bench.phase, up, down)
    after = phase.weights(moved.bench.phase, up + shift, down + shift)
    assert after == pytest.approx(before, rel=1e-9, abs=1e-15)
    assert before.max() > 0.0


@given(st.integers(10, 60), st.integers(0, 2**40))
@budget(max_examples=10)
def test_every_part_of_every_range_is_used_once(n: int, seed: int) -> None:
    sample = draw(BASE, UNCERTAIN, n, seed)
    low, high = (np.array([getattr(u, side) for u in UNCERTAIN]) for side in ("low", "high"))
    cells = np.floor((sample.amounts - low) / (high - low) * n).astype(int)
    assert sample.amounts.shape == (n, len(UNCERTAIN))
    assert sample.refused == 0
    assert (np.sort(cells, axis=0) == np.arange(n)[:, None]).all()


def test_a_seed_repeats_its_sample_and_another_does_not() -> None:
    first, again, other = (draw(BASE, UNCERTAIN, 12, s).amounts for s in (3, 3, 4))
    assert (first == again).all()
    assert (first != other).any()


def test_default_sample_is_possible_throughout() -> None:
    sample = draw(BASE, UNCERTAIN, 100, 0)
    for amounts in sample.amounts:
        config.check(settings_at(BASE, UNCERTAIN, amounts), "sample")


def test_impossible_machines_are_replaced_and_counted() -> None:
    """A share of the stage's motion above 1 is out of the parameter's bounds."""
    base = replaced(BASE, "bench.belt.participation", 0.7)
    sample = draw(base, UNCERTAIN, 40, 0)
    assert len(sample.amounts) == 40
    assert sample.refused > 0
    assert "belt.participation" in sample.reason
    share = sample.amounts[:, [u.name for u in UNCERTAIN].index("belt_share")]
    assert (0.7 * share <= 1.0).all()


def test_hopeless_settings_are_refused_in_words() -> None:
    base = replaced(BASE, "bench.belt.participation", 0.9)
    narrow = (BY_NAME["belt_share"]._replace(low=1.2),)
    with pytest.raises(InputError, match=r"belt\.participation"):
        draw(base, narrow, 10, 0)


def test_refusal_names_bounds() -> None:
    assert refusal(BASE, UNCERTAIN) is None
    words = refusal(replaced(BASE, "bench.belt.frequency", 500.0), UNCERTAIN)
    assert words is not None
    assert "bench.belt.frequency" in words


def test_a_stream_of_its_own_shares_no_machine() -> None:
    first, other = (draw(BASE, UNCERTAIN, 12, seed).amounts for seed in (3, (3, 1)))
    assert not np.isin(first, other).any()
