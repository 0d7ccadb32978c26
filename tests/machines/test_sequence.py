"""Moves one after another: set points with derivatives, arrival, patience, hold, end."""

import math

import numpy as np
import pytest

from macromicro.control.stage_law import Sample
from macromicro.machines import sequence
from macromicro.machines.sequence import DONE, HOLDING, MOVING, WAITING, Arrival, Plan, begin
from macromicro.motion import s_curve

RULE = Arrival(tolerance=1e-3, dwell=0.01, patience=0.05)
DT = 1e-3


def plan(*targets, hold=0.02, start=None, end=math.nan):
    before, pieces, first, length = 0.0, [], [0], []
    for target in targets:
        profile = s_curve(target - before, 1.0, 20.0, 2000.0, start=before)
        for border, segment in zip(profile.borders, profile.segments, strict=False):
            pieces.append([border, *segment[1:]])
        first.append(len(pieces))
        length.append(profile.duration)
        before = target
    n = len(targets)
    return Plan(
        np.full(n, math.nan) if start is None else np.array(start),
        np.array(targets),
        np.full(n, hold),
        np.array(length),
        np.array(first),
        np.array(pieces).reshape(-1, 5),
        0.0,
        end,
    )


def run(p, follow=lambda target, t: target.position, periods=2000):
    """Rows of (t, phase, move, arrived, target) with a stage that shows what `follow` says."""
    s, rows, place = begin(), [], 0.0
    for k in range(periods):
        s, target = sequence.step(p, RULE, s, Sample(k * DT, place))
        place = follow(target, k * DT)
        rows.append((k * DT, s.phase, s.move, s.arrived, target))
        if s.phase == DONE:
            break
    return rows


def test_the_set_point_is_the_profile_with_its_derivatives():
    p = plan(0.03, -0.02)
    ways = (s_curve(0.03, 1.0, 20.0, 2000.0), s_curve(-0.05, 1.0, 20.0, 2000.0, start=0.03))
    began = {}
    for t, phase, move, _, target in run(p):
        since = t - began.setdefault(move, t)
        if phase == MOVING and since < ways[move].duration - 1e-9:
            truth = ways[move].at(since)
            assert target.position == pytest.approx(truth.position, abs=1e-12)
            assert target.velocity == pytest.approx(truth.velocity, abs=1e-9)
            assert target.acceleration == pytest.approx(truth.acceleration, abs=1e-7)
        else:
            assert target == (p.target[move], 0.0, 0.0, math.inf)


def test_it_begins_with_nothing_and_keeps_the_piece_that_it_is_on():
    assert begin()[:4] == (WAITING, -1, 0, 0.0) and begin().arrived == 0
    p = plan(0.03)
    s, pieces = begin(), []
    for k in range(400):
        s, _ = sequence.step(p, RULE, s, Sample(k * DT, 0.0))
        pieces.append(s.piece)
    assert pieces == sorted(pieces) and pieces[-1] >= p.first[1] - 2 > 0


def test_a_move_arrives_after_the_dwell_and_is_held():
    p = plan(0.03, -0.01)
    rows = run(p)
    assert [r[1] for r in rows[:2]] == [MOVING, MOVING]
    moved = [r for r in rows if r[2] == 0]
    arrived = next(r[0] for r in moved if r[3] == 1)
    assert arrived == pytest.approx(p.length[0] + RULE.dwell, abs=1.5 * DT)
    following = next(r[0] for r in rows if r[2] == 1)
    assert following == pytest.approx(arrived + 0.02, abs=1.1 * DT)
    assert all(r[3] == 0 for r in rows if r[2] == 1 and r[0] < following + p.length[1])
    assert all(r[4].position == 0.03 and r[4].velocity == 0.0 for r in moved if r[1] == HOLDING)
    assert rows[-1][1] == DONE and rows[-1][4].position == -0.01
    end = next(r[0] for r in rows if r[2] == 1 and r[1] == HOLDING) + 0.02
    assert rows[-1][0] == pytest.approx(end, abs=1.1 * DT)


def test_a_move_that_does_not_arrive_is_given_up_after_the_patience():
    p = plan(0.03)
    rows = run(p, lambda target, t: target.position + 1.01e-3)
    held = next(r for r in rows if r[1] == HOLDING)
    assert held[0] == pytest.approx(p.length[0] + RULE.patience, abs=1.1 * DT)
    assert held[3] == 0 and rows[-1][1] == DONE
    late = plan(0.03, start=[0.1], hold=math.inf, end=2.0)
    rows = run(late, lambda target, t: target.position + 1.01e-3)
    held = next(r for r in rows if r[1] == HOLDING)
    assert held[0] == pytest.approx(0.1 + late.length[0] + RULE.patience, abs=1.1 * DT)


def test_at_the_tolerance_it_arrives():
    assert any(r[3] for r in run(plan(0.03), lambda target, t: target.position + 0.99e-3))


def test_leaving_the_tolerance_begins_the_dwell_anew():
    p = plan(0.03)
    late = p.length[0] + 0.005
    rows = run(p, lambda target, t: target.position + (0.1 if late < t < late + 1.5 * DT else 0.0))
    arrived = next(r[0] for r in rows if r[3] == 1)
    assert arrived > p.length[0] + 0.005 + RULE.dwell


def test_a_scheduled_move_waits_for_its_time_and_the_next_one_ends_it():
    p = plan(0.01, 0.02, hold=math.inf, start=[0.05, 0.3], end=0.5)
    rows = run(p)
    assert rows[0][1:] == (WAITING, -1, 0, (0.0, 0.0, 0.0, math.inf))
    assert sequence.aim(p, begin(), 0.0) == (0.0, 0.0, 0.0, math.inf)
    for move, t in ((0, 0.05), (1, 0.3)):
        assert next(r[0] for r in rows if r[2] == move) == pytest.approx(t, abs=0.5 * DT)
    assert rows[-1][1] == DONE and rows[-1][0] == pytest.approx(0.5, abs=0.5 * DT)


def test_no_way_to_go_is_a_move_all_the_same():
    rows = run(plan(0.0, 0.01))
    assert rows[-1][1] == DONE and {r[2] for r in rows} == {0, 1}
    assert next(r for r in rows if r[2] == 1)[0] == pytest.approx(0.03, abs=2.1 * DT)


def test_done_stays_done():
    p = plan(0.01)
    rows = run(p)
    s = sequence.Progress(DONE, 0, 0, rows[-1][0], math.nan, 1)
    again, target = sequence.step(p, RULE, s, Sample(9.0, 0.5))
    assert again == s and target == (0.01, 0.0, 0.0, math.inf) == rows[-1][4]
