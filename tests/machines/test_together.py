"""The sequence of two stages, period by period, from samples made by hand."""

import math

import numpy as np
import pytest

from macromicro.control.stage_law import Sample, Target
from macromicro.machines import sequence
from macromicro.machines.sequence import DONE, HOLDING, MOVING, WAITING, Arrival, Plan
from macromicro.machines.stage import Loop

DT = 0.01
NAN = math.nan


def plan(*targets):
    """Moves of 0.1 s at constant speed, each held for 0.05 s."""
    froms = (0.0, *targets[:-1])
    rows = [(0.0, a, (b - a) / 0.1, 0.0, 0.0) for a, b in zip(froms, targets, strict=True)]
    n = len(targets)
    return Plan(
        start=np.full(n, NAN),
        target=np.array(targets),
        hold=np.full(n, 0.05),
        length=np.full(n, 0.1),
        first=np.arange(n + 1),
        pieces=np.array(rows),
        origin=0.0,
        end=NAN,
    )


def loops(first, second, *, patience=(1.0, 1.0), dwell=(0.02, 0.02)):
    rules = [Arrival(1e-4, d, p) for d, p in zip(dwell, patience, strict=True)]
    return tuple(Loop(None, None, r, p) for r, p in zip(rules, (first, second), strict=True))


def run(both, n, errors=(lambda t: 0.0, lambda t: 0.0)):
    """Phases, moves and targets of n periods; each stage is off its set point by its error."""
    progress, inside, seen = sequence.begin(), (NAN, NAN), []
    step = sequence.together(2)
    places = [0.0, 0.0]
    for k in range(n):
        t = k * DT
        # A stage is where its set point is, less its error: the sequence is asked twice.
        here = (Sample(t, places[0]), Sample(t, places[1]))
        _, _, aims = step(both, progress, inside, here)
        places = [aim.position - error(t) for aim, error in zip(aims, errors, strict=True)]
        here = (Sample(t, places[0]), Sample(t, places[1]))
        progress, inside, aims = step(both, progress, inside, here)
        seen.append((progress, *aims))
    return seen


def began(seen, phase, move=0):
    """When a phase of a move began, in periods."""
    return next(k for k, (s, *_) in enumerate(seen) if s.phase == phase and s.move == move)


def test_both_follow_their_own_plans_on_the_same_times():
    seen = run(loops(plan(1.0, 3.0), plan(-2.0, -2.5)), 12)
    assert seen[0][0].phase == MOVING and seen[0][0].move == 0
    for k in range(10):
        _, one, two = seen[k]
        assert one.position == pytest.approx(10.0 * k * DT) and one.velocity == 10.0
        assert two.position == pytest.approx(-20.0 * k * DT) and two.velocity == -20.0
    assert seen[10][1:] == (Target(1.0, 0.0, 0.0), Target(-2.0, 0.0, 0.0))


def test_the_hold_and_the_next_move_begin_when_both_have_arrived():
    both = loops(plan(1.0, 3.0), plan(-2.0, -2.5))
    seen = run(both, 60)
    held = began(seen, HOLDING)
    assert held == 12  # the profile's end and the dwell
    assert seen[held][0].arrived == 1 and seen[held - 1][0].arrived == 0
    assert began(seen, MOVING, 1) == held + 5
    second = began(seen, MOVING, 1)
    assert seen[second][1].position == 1.0 and seen[second + 1][2].position < -2.0
    done = began(seen, DONE, 1)
    assert done == second + 12 + 5
    assert seen[-1][1:] == (Target(3.0, 0.0, 0.0), Target(-2.5, 0.0, 0.0))
    assert seen[-1][0].phase == DONE


@pytest.mark.parametrize("late", [0, 1])
def test_it_waits_for_the_later_one(late):
    errors = [lambda t: 0.0, lambda t: 0.0]
    errors[late] = lambda t: 1.0 if t < 0.295 else 0.0
    seen = run(loops(plan(1.0, 3.0), plan(-2.0, -2.5)), 60, errors)
    assert began(seen, HOLDING) == 32 and seen[32][0].arrived == 1

    def leaves(t):
        return 1.0 if 0.105 < t < 0.205 else 0.0

    errors[late] = leaves  # within, out again, within: the dwell counts anew
    assert began(run(loops(plan(1.0), plan(-2.0)), 60, errors), HOLDING) == 23


@pytest.mark.parametrize("late", [0, 1])
def test_the_longer_patience_counts(late):
    errors = [lambda t: 0.0, lambda t: 0.0]
    errors[late] = lambda t: 1.0
    for patience in ((0.1, 0.2), (0.2, 0.1)):
        seen = run(loops(plan(1.0), plan(-2.0), patience=patience), 60, errors)
        assert began(seen, HOLDING) == 30 and seen[30][0].arrived == 0


@pytest.mark.parametrize("dwell", [(0.0, 0.05), (0.05, 0.0)])
def test_the_time_within_begins_anew_with_each_move(dwell):
    both = loops(plan(1.0, 3.0), plan(-2.0, -2.5), dwell=dwell)
    seen = run(both, 60)
    first = began(seen, HOLDING)
    second = began(seen, MOVING, 1)
    assert first == 15
    assert began(seen, HOLDING, 1) == second + 15


def test_before_the_first_move_it_waits():
    later = plan(1.0)._replace(start=np.array([0.05]), end=0.5)
    other = plan(-2.0)._replace(start=np.array([0.05]), end=0.5)
    seen = run(loops(later, other), 55)
    assert [s.phase for s, *_ in seen[:5]] == [WAITING] * 5
    assert began(seen, MOVING) == 5 and began(seen, DONE) == 50
