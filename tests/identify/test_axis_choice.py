"""The friction that a record asks for: blocks of it held out in turn, and why not the others."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import _axis_hints, drive
from macromicro.identify._axis_hints import blocks, folds
from macromicro.identify.axis_inverse import Rows
from macromicro.identify.engine import no_better, turn
from macromicro.identify.runs import Run
from macromicro.models.mass import Axis, simulate

DT = 1e-3


def record(truth: Axis, u: Array) -> tuple[Array, Array, Array]:
    """Its position under these forces, with a noise of 2 um."""
    noise = 2e-6 * np.random.default_rng(1).standard_normal(len(u))
    return np.arange(len(u)) * DT, u, simulate(truth, u, DT, 0.0, 0.0) + noise


def steps(low: float, high: float, number: int = 50) -> Array:
    """Forces of 0.4 s each."""
    return np.repeat(np.random.default_rng(0).uniform(low, high, number), 400)


@pytest.mark.slow
def test_reverse_motion_in_the_tail_alone_hides_no_friction() -> None:
    """What is fitted sees it too: Stribeck friction is found, not a viscous slope."""
    u = steps(30.0, 90.0, 100)
    u[-5000:] *= -1.0
    truth = Axis(mass=95.0, viscous=100.0, coulomb=20.0, stribeck=40.0, stribeck_speed=0.05)
    found = drive(*record(truth, u))
    assert found.structure == "stribeck"
    assert found.axis.mass == pytest.approx(95.0, rel=0.01)
    assert found.reasons["viscous"] == "coulomb is better"
    assert found.reasons["coulomb"] == "stribeck is better"
    assert found.reasons["asymmetric"] == "not 2 % better than coulomb"
    assert set(found.reasons) == {"viscous", "coulomb", "asymmetric", "full"}


@pytest.mark.slow
def test_slow_motion_that_is_held_out_all_at_once_hides_no_friction() -> None:
    """The other blocks give breakaway friction of either sign, by chance."""
    u, slow = steps(100.0, 160.0), steps(-70.0, 70.0, 4)
    for held in np.flatnonzero(turn(np.arange(12)) == 0):
        at = 20_000 * held // 12
        u[at : at + len(slow)] = slow
    truth = Axis(mass=95.0, viscous=100.0, coulomb=20.0, stribeck=40.0, stribeck_speed=0.05)
    found = drive(*record(truth, u))
    assert found.structure == "stribeck"
    assert found.axis.stribeck == pytest.approx(40.0, rel=0.02)
    assert "full" in found.reasons


@pytest.mark.slow
def test_the_only_reverse_motion_may_be_held_out() -> None:
    """The rest does not tell Coulomb friction from a constant force, and is judged so."""
    u = steps(30.0, 150.0)
    u[-1250:] *= -1.0
    found = drive(*record(Axis(mass=95.0, viscous=200.0, coulomb=20.0), u))
    assert found.structure == "coulomb" and found.reasons["viscous"] == "coulomb is better"
    assert found.axis.coulomb == pytest.approx(20.0, rel=0.01)
    assert found.holdout_rms < 1e-4  # blocks of both directions, from speeds of their own


def test_what_one_way_motion_cannot_tell_apart_is_said() -> None:
    found = drive(*record(Axis(mass=95.0, viscous=200.0, coulomb=20.0), steps(40.0, 160.0)))
    assert found.structure == "viscous" and list(found.holdout) == ["viscous"]
    assert found.reasons["coulomb"] == "the motion does not determine its parameters"
    assert found.axis.mass == pytest.approx(95.0, rel=0.01)
    with pytest.raises(InputError, match=r"viscous: the mass or .+ accelerated motion in both"):
        drive(*record(Axis(mass=95.0, viscous=200.0), np.r_[np.zeros(300), np.full(600, 50.0)]))


@pytest.mark.parametrize("low", [-160.0, 30.0])
def test_a_force_with_the_wrong_sign_is_told_as_such_one_way_too(low: float) -> None:
    t, u, x = record(Axis(mass=95.0, viscous=200.0, coulomb=20.0), steps(low, 160.0))
    with pytest.raises(InputError, match="Check the signs of u, x and gain"):
        drive(t, -u, x)


def test_a_simple_axis_is_not_given_more_than_it_has() -> None:
    found = drive(*record(Axis(mass=95.0, viscous=200.0, coulomb=20.0), steps(-120.0, 120.0, 25)))
    assert found.structure == "coulomb"
    assert set(found.reasons) == {"viscous", "asymmetric", "stribeck", "full"}


def numbered(n: int, factor: int = 1) -> Rows:
    k = np.arange(float(n))
    return Rows(Run(k, k, k), k, k, k, k > 1.0, factor)


def test_blocks_are_even_and_long_enough_to_be_decimated() -> None:
    made = blocks([numbered(1000, 5), numbered(10_000, 5), numbered(50, 5)])
    assert [len(b.v) for b in made[:5]] == [200] * 5
    assert [len(b.v) for b in made[5:17]].count(833) == 8 and len(made) == 5 + 12 + 1
    assert np.concatenate([b.v for b in made[5:17]]).tolist() == list(range(10_000))
    assert len(made[-1].v) == 50


def test_every_block_is_held_out_once() -> None:
    seen = []
    for train, test in folds([numbered(480)]):
        assert len(train) == 8 and len(test) == 4
        own = np.sort(np.concatenate([b.v for b in (*train, *test)]))
        assert own.tolist() == list(range(480))
        seen += [float(b.v[0]) for b in test]
    assert sorted(seen) == [40.0 * k for k in range(12)]


@pytest.mark.parametrize(
    ("richer", "gained", "said"),
    [
        (0.99, np.full(6, 1.0), "not 2 % better than x"),
        (0.97, np.full(6, 1.0), ""),
        (0.97, np.array([1.0]), ""),
        (0.5, np.array([5.0, -1.0, 4.0, -3.0]), "better than x, but by less than the scatter"),
        (0.5, np.array([1.0, 3.0, 1.0, 3.0]), ""),
    ],
)
def test_a_richer_structure_has_to_be_better_by_more_than_noise(
    richer: float, gained: Array, said: str
) -> None:
    found = no_better(1.0, richer, gained, "x")
    assert found.startswith(said) and bool(found) == bool(said)


def test_what_nobody_spoke_of_must_be_surer_than_a_structure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A gain of two and a half standard errors is one for a structure, not for a delay."""
    gained = 1.0 + 0.4 * 4.0 * np.array([1.0, -1.0] * 8) / np.sqrt(16.0 / 15.0)  # 0.4 its error
    assert no_better(1.0, 0.5, gained, "x") == ""
    assert "by less than the scatter of the blocks" in no_better(1.0, 0.5, gained, "x", 3.0)
    squares = iter([np.exp(gained), np.ones(16)])
    monkeypatch.setattr(_axis_hints, "held_out", lambda rows, name: next(squares))
    made = [Rows(Run(*[np.ones(9)] * 3), *[np.ones(9)] * 4, 1)]  # type: ignore[arg-type]
    assert _axis_hints.lowered_by(made, made, "x") is None
