"""Forces that disturb an axis with elastic friction: found along its way, filters taken off."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from tests.identify.elastic import DT, STAGE

from macromicro.arrays import Array
from macromicro.identify import presliding
from macromicro.identify._presliding_force import disturbed, needed, rubbed
from macromicro.identify._presliding_search import Problem, Shape, problem_of
from macromicro.identify.axis import Axis
from macromicro.identify.axis_inverse import Estimate, Rows, differences
from macromicro.identify.presliding import Presliding, simulate
from macromicro.identify.runs import Run
from macromicro.kernel import compiled

NAMES = ("mass", "viscous", "offset", "stiffness", "settling", "asymmetry")
TRUTH = STAGE._replace(asymmetry=4.0)
ELEMENTS = TRUTH._replace(shares=np.array([0.1, 0.2, 0.3, 0.4]))


def moved(axis: Presliding, n: int, push: Array | float = 0.0) -> Rows:
    """A record of strokes, under a force that nobody measured."""
    t = np.arange(n) * DT
    u = 11.0 * np.sin(1.4 * np.pi * t)
    x = simulate(axis, u + push, DT)
    return differences(Run(t, u, x), u, 80.0, 5)


def problem(rows: Rows, axis: Presliding) -> tuple[Problem, Array, Shape, list[Array]]:
    """A search that stands at the truth."""
    rigid = Estimate(Axis(2.0, 15.0, 5.0), ("mass", "viscous", "coulomb"), np.eye(3), 0.0, 0.0)
    made = problem_of([rows], rigid)
    inner = np.log(np.sqrt(axis.stiffness / axis.mass) * DT)
    z = [1.0, 1.0, axis.offset / 5.0, inner, axis.settling / DT, axis.asymmetry / 15.0, 1.0]
    odds = list(np.log(axis.shares[1:] / axis.shares[0])) if len(axis.shares) else []
    friction = "gms" if odds else "lugre"
    at, shape = np.array(z + odds), Shape(friction, NAMES, 1)
    return made, at, shape, made.missed(at, shape)


@pytest.mark.parametrize("axis", [TRUTH, ELEMENTS])
def test_friction_along_a_way_is_what_the_free_run_has(axis: Presliding) -> None:
    """Between the samples the speed is taken as even: within 2 % of the level, on average 0.3 %."""
    n, h = 6000, DT / 4
    pull = 11.0 * np.sin(1.4 * np.pi * np.arange(n) * h) - axis.offset
    room = np.empty(max(len(axis.shares), 1))
    x, true = np.zeros(n), np.zeros(n)
    place, v = 0.0, 0.0
    compiled(presliding.begin)(axis, room, place, v, pull[0])
    move = compiled(presliding.step)
    before = float(room.sum())
    for k in range(n):
        x[k] = place
        v, gone = move(axis, room, place, v, pull[k], h)
        place += gone
        after = float(room.sum())
        true[k] = 0.5 * (before + after) + axis.settling * (after - before) / h
        before = after
    found = np.empty(n)
    compiled(rubbed)(axis, x, 0.0, pull, h, np.empty(len(room)), found)
    error = np.abs(found - true)[:-1]
    assert np.mean(error) < 0.015 and np.max(error) < 0.1
    assert np.ptp(true) > 9.0 and found[-1] == found[-2]


@pytest.mark.parametrize("axis", [TRUTH, ELEMENTS])
def test_the_force_along_a_record_is_the_measured_one(axis: Presliding) -> None:
    rows = moved(axis, 6000)
    force = needed(rows, axis)
    plain = needed(rows, axis._replace(mass=1e-9, viscous=0.0, asymmetry=0.0, offset=0.0))
    assert np.sqrt(np.mean(force**2)) == pytest.approx(9.0, abs=2.0)
    assert len(force) == len(plain) and np.abs(force).max() > 1.5 * np.abs(plain).max()


@pytest.mark.parametrize("axis", [TRUTH, ELEMENTS])
def test_a_slow_force_is_found_as_strong_as_it_is(axis: Presliding) -> None:
    """Rigid inverse dynamics would show the friction's give, here twenty times as much."""
    rows = moved(axis, 20_000)
    quiet, taken, repeats = disturbed(*problem(rows, axis))
    assert repeats is None
    table = np.concatenate(taken)
    assert table.shape[1] == len(NAMES) + 1 + max(len(axis.shares) - 1, 0)
    assert np.sqrt(np.mean(np.concatenate(quiet) ** 2)) < 1e-3
    white = np.random.default_rng(0).standard_normal(20_000)
    push = lfilter([0.04 * np.sqrt(1.0 - 0.99**2)], [1.0, -0.99], white)
    seen = disturbed(*problem(moved(axis, 20_000, push), axis))
    found = np.concatenate(seen.missed)
    assert seen.repeats is None  # no period in what goes with the time
    assert 0.6 * push.std() < np.sqrt(np.mean(found**2)) < 1.1 * push.std()
    # What parameters can take up is not in it.
    again = np.concatenate(seen.taken)
    assert np.abs(
        np.linalg.lstsq(again, found, rcond=None)[0] * np.sqrt((again**2).sum(0))
    ).max() < (1e-6)


def test_pieces_that_the_low_pass_eats_show_nothing() -> None:
    rows = moved(TRUTH, 600)._replace(factor=20)
    assert disturbed(*problem(rows, TRUTH)) == ([], [], None)


def test_a_force_that_repeats_along_the_way_is_told_from_the_rest() -> None:
    """25 mN every 60 mm, beside 5 mN of white force: the former is found, the latter is left."""
    n, axis = 8000, TRUTH._replace(asymmetry=0.0)
    t = np.arange(n) * DT
    u = 11.0 * np.sin(1.4 * np.pi * t)
    push = u + 0.005 * np.random.default_rng(0).standard_normal(n)
    x, place, v, bristle = np.empty(n), 0.0, 0.0, np.zeros(1)
    move = compiled(presliding.step)
    compiled(presliding.begin)(axis, bristle, place, v, push[0] - axis.offset)
    for k in range(n):
        x[k] = place
        pull = push[k] + 0.025 * np.sin(2.0 * np.pi / 0.06 * place + 1.0) - axis.offset
        v, gone = move(axis, bristle, place, v, pull, DT)
        place += gone
    found = disturbed(*problem(differences(Run(t, u, x), u, 80.0, 5), axis))
    assert found.repeats is not None
    assert 2.0 * np.pi / found.repeats.turn == pytest.approx(0.06, rel=0.03)
    assert found.repeats.size == pytest.approx(0.025, rel=0.15)
    assert np.sqrt(np.mean(np.concatenate(found.missed) ** 2)) < 0.005


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_noise_of_the_position_at_rest_sets_no_friction_to_its_level(seed: int) -> None:
    """A record that begins with wiggles: 0.07 N were seen where noise makes 0.006 N."""
    n = 8000
    t = np.arange(n) * DT
    u = np.where(t > 3.0, 11.0 * np.sin(1.4 * np.pi * t), 3.5 * np.cos(6.2 * np.pi * t))
    axis = TRUTH._replace(asymmetry=0.0)
    x = simulate(axis, u, DT) + 1e-7 * np.random.default_rng(seed).standard_normal(n)
    found = disturbed(*problem(differences(Run(t, u, x), u, 80.0, 5), axis))
    assert np.sqrt(np.mean(np.concatenate(found.missed) ** 2)) < 0.012
