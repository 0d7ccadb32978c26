"""Which targets are taken, by which stage, and what is told of those that are not."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.control.live import messages as m
from macromicro.control.live import targets
from macromicro.control.live.messages import Accepted, Refused
from macromicro.control.live.state import LiveState, Motion
from macromicro.control.supervisor import Plan

from .bench import PITCH, homed

NAN = math.nan
BENCH = homed()
P, S = BENCH.p, BENCH.s
OWN = homed().p.settings.limits


@pytest.mark.parametrize("by_laser", [False, True])
@given(macro_high=st.floats(200.0, OWN.macro_high), micro_high=st.floats(1e-3, OWN.micro_high))
def test_both_ends_of_the_reach_are_accepted_and_no_more_is(
    by_laser: bool, macro_high: float, micro_high: float
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(targets, "by_laser", lambda p, s: by_laser)
        limits = OWN._replace(macro_high=macro_high, micro_high=micro_high)
        bench = homed()
        assert bench.ask(m.SetLimits(limits)) == Accepted()
        tolerance = bench.s.laws.sequence.tolerance
        low, high = targets.reach(bench.p.settings, limits, tolerance)
        assert limits.whole_low <= low < high <= limits.whole_high
        for target in (low, high):
            found = targets.whole(bench.p, bench.s, target, "move", False)
            assert not isinstance(found, Refused), found
        if by_laser:
            beyond = targets.whole(bench.p, bench.s, high + 1e-8, "move", False)
            assert isinstance(beyond, Refused)


def seen(encoder: float = 0.0, fine: float = 0.0, offset: float = 0.0, **frame: Any) -> LiveState:
    """Standing at `encoder` [raw counts] with this contraction [m]."""
    frame_ = S.frame._replace(offset=offset, **frame)
    return S._replace(seen=S.seen._replace(encoder=encoder, fine=fine), frame=frame_)


def bounded(s: LiveState, **limits: float) -> LiveState:
    return s._replace(limits=s.limits._replace(**limits))


def accepted(found: Motion | Refused) -> Motion:
    assert not isinstance(found, Refused), found
    return found


def refused(found: Motion | Refused) -> Refused:
    assert isinstance(found, Refused)
    return found


def test_what_is_beyond_the_soft_limits_is_told_in_mm_and_counts() -> None:
    for target, told in ((0.3, "300"), (-0.0089, "-8.9")):
        found = refused(targets.whole(P, S, target, "move to", True))
        assert found.reason == f"position {told} mm is beyond the soft limits"
        assert found.remedy == "give one from -8.8 to 216.9 mm" and found.beyond
    found = refused(targets.coarse(S, 2991))
    assert found.reason == "macro position 2991 counts is beyond the soft limits"
    assert found.remedy == "give one from -130 to 2990 counts" and found.beyond
    found = refused(targets.contraction(S, 3.6e-3))
    assert found.reason == "micro position 3.6 mm is beyond the soft limits"
    assert found.remedy == "give one from 0 to 3.5 mm" and found.beyond


@pytest.mark.parametrize("value", ["7", None, NAN, math.inf])
def test_what_is_no_number_is_told_with_the_unit_that_is_wanted(value: Any) -> None:
    for found, unit in (
        (targets.whole(P, S, value, "move to", True), "m"),
        (targets.coarse(S, value), "counts"),
        (targets.contraction(S, value), "m"),
        (targets.jog(P, S, "macro", value, 0.0), "m/s"),
    ):
        told = refused(found)
        assert "is not a finite number" in told.reason
        assert told.remedy == f"give it in {unit}" and told.beyond


def test_whole_numbers_become_floats() -> None:
    """Whatever is recorded and sent of a motion is of one kind."""
    s = seen(-20.0)
    for found in (
        accepted(targets.whole(P, s, 0, "move to", True)).target,
        accepted(targets.coarse(s, 7)).coarse,
        accepted(targets.contraction(s, 0)).fine,
    ):
        assert type(found) is float


def test_a_motion_has_the_next_number_and_begins_now() -> None:
    s = S._replace(given=4, time=12.5)
    found = accepted(targets.contraction(s, 1e-3))
    assert (found.id, found.kind, found.fine, found.began) == (5, "move micro", 1e-3, 12.5)
    assert math.isnan(found.target) and math.isnan(found.coarse)


@pytest.mark.parametrize(("offset", "encoder"), [(0.0, 100.0), (-37.0, 63.0)])
def test_the_micro_stage_alone_goes_where_the_rest_is_in_its_band(
    offset: float, encoder: float
) -> None:
    """From count 100 of the homed frame, which is 7.142857 mm."""
    s = seen(encoder, offset=offset)
    for rest, alone in ((0.299e-3, False), (0.301e-3, True), (3.499e-3, True), (3.501e-3, False)):
        target = 100 * PITCH + rest
        found = accepted(targets.whole(P, s, target, "move to", True))
        assert found.target == target and found.kind == "move to"
        if alone:
            assert found.fine == pytest.approx(rest, abs=1e-12) and math.isnan(found.coarse)
        else:
            assert math.isnan(found.fine) and not math.isnan(found.coarse)


@pytest.mark.parametrize(("low", "high"), [(0.5e-3, 3.5e-3), (0.0, 2e-3)])
def test_its_band_ends_at_its_soft_limits(low: float, high: float) -> None:
    s = bounded(S, micro_low=low, micro_high=high)
    for rest in (max(low, 0.3e-3) - 1e-6, high + 1e-6):
        assert math.isnan(accepted(targets.whole(P, s, rest, "move to", True)).fine)
    for rest in (max(low, 0.3e-3) + 1e-6, high - 1e-6):
        found = accepted(targets.whole(P, s, rest, "move to", True))
        assert found.fine == pytest.approx(rest, abs=1e-12)


def test_a_carriage_that_moves_is_sent_though_the_micro_stage_would_reach() -> None:
    found = accepted(targets.whole(P, S, 0.002, "move to", False))
    assert math.isnan(found.fine) and not math.isnan(found.coarse)


@pytest.mark.parametrize("offset", [0.0, -512.0, 77.0])
@pytest.mark.parametrize(("by_laser", "slack"), [(False, 2.0), (True, 2.5)])
def test_the_carriage_goes_to_the_highest_count_that_leaves_the_band(
    monkeypatch: pytest.MonkeyPatch, by_laser: bool, slack: float, offset: float
) -> None:
    """0.3 mm at least, with all of its tolerance (and half a count that the laser resolves)."""
    monkeypatch.setattr(targets, "by_laser", lambda p, s: by_laser)
    s = seen(offset, offset=offset)
    for target in np.linspace(-0.006, 0.2, 97).tolist():
        found = accepted(targets.whole(P, s, target, "move to", False))
        count = found.coarse - offset
        least = (target - (count + slack) * PITCH) * 1e3
        assert 0.3 - 1e-9 <= least < 0.3 + PITCH * 1e3


def test_the_last_count_is_the_last_that_is_whole() -> None:
    s = bounded(S, macro_high=2000.9)
    target = 2000 * PITCH + 3.2e-3
    found = accepted(targets.whole(P, s, target, "move to", False))
    assert found.coarse == 2000.0


@pytest.mark.parametrize(
    ("limits", "target"), [({"macro_low": 100.0}, 0.0071), ({"macro_high": 2000.0}, 0.1464)]
)
def test_what_both_stages_together_do_not_reach_is_refused(
    limits: dict[str, float], target: float
) -> None:
    found = refused(targets.whole(P, bounded(S, **limits), target, "move to", False))
    beyond = "is beyond the reach of both stages together"
    assert found.reason == f"position {target * 1e3:.9g} mm {beyond}" and found.beyond


def test_the_reach_is_bounded_by_both_stages() -> None:
    """Whole counts within, the tolerance and half a count, the micro-stage's band; in whole
    nanometres, one less than would do."""
    limits = OWN._replace(macro_low=-40.5, macro_high=2000.5)
    # (-40 + 2.5) counts and 0.3 mm; (2000 - 2.5) counts and 3.5 mm
    assert targets.reach(P.settings, limits, 2.0) == (-0.002378570, 0.146178570)
    narrow = limits._replace(micro_low=0.4e-3, micro_high=3e-3)
    assert targets.reach(P.settings, narrow, 2.0) == (-0.002278570, 0.145678570)
    wide = limits._replace(micro_low=0.2e-3, micro_high=4e-3)
    assert targets.reach(P.settings, wide, 2.0) == targets.reach(P.settings, limits, 2.0)
    inner = limits._replace(whole_low=-0.001, whole_high=0.1)
    assert targets.reach(P.settings, inner, 2.0) == (-0.001, 0.1)


def test_the_carriage_is_sent_to_whole_counts_of_the_homed_frame() -> None:
    s = seen(0.0, offset=-30.0)
    assert accepted(targets.coarse(s, 100)).coarse == 70.0
    assert "not a whole number" in refused(targets.coarse(s, 100.5)).reason


def test_each_stage_has_its_fastest_jog_and_an_unknown_place_a_slow_one() -> None:
    q, lost = P.settings.jogging, seen(trusted=False)
    s = seen(fine=1e-3)
    for where, stage, most, hint in (
        (s, "macro", q.macro, ""), (s, "micro", q.micro, ""),
        (lost._replace(seen=s.seen), "macro", q.slow, " (not homed)"),
        (lost._replace(seen=s.seen), "micro", q.micro, ""),
    ):  # fmt: skip
        for sign in (1.0, -1.0):
            assert accepted(targets.jog(P, where, stage, sign * most, 0.0)).kind == f"jog {stage}"
            too_fast = sign * most * 1.01
            found = refused(targets.jog(P, where, stage, too_fast, 0.0))
            assert found.reason == f"speed {too_fast:.9g} m/s is too fast{hint}"
            assert found.remedy == f"at most {most:g} m/s" and found.beyond
    assert refused(targets.jog(P, s, "third", 0.0, 0.0)).reason == "'third' is not a stage"


@pytest.mark.parametrize("hold", [-0.001, 10.001, math.nan, "1"])
def test_a_jog_goes_on_for_its_hold_time_at_most(hold: Any) -> None:
    for good in (0.0, 10.0):
        assert accepted(targets.jog(P, S, "macro", 0.01, good)).kind == "jog macro"
    found = refused(targets.jog(P, S, "macro", 0.01, hold))
    assert "is not a hold time" in found.reason and found.remedy == "from 0 to 10 s"


@pytest.mark.parametrize("trusted", [True, False])
@pytest.mark.parametrize("stage", m.STAGES)
def test_a_jog_leads_away_from_a_soft_limit_only(stage: str, trusted: bool) -> None:
    """Of the carriage only where its place is known; at rest nothing is asked of it."""
    for at, blocked in ((0, -1.0), (1, 0.0), (2, 1.0)):
        place = {"macro": (-130.0, 5.0, 2990.0), "micro": (0.0, 1e-3, 3.5e-3)}[stage][at]
        where = {"macro": {"encoder": place + 9.0}, "micro": {"fine": place}}[stage]
        s = seen(offset=9.0, trusted=trusted, **where)
        for speed in (-1e-4, 0.0, 1e-4):
            found = targets.jog(P, s, stage, speed, 0.0)
            if speed * blocked > 0.0 and (trusted or stage == "micro"):
                assert refused(found).reason == f"the {stage}-stage is at its soft limit"
                assert not refused(found).beyond
            else:
                accepted(found)


def plan(**columns: Any) -> Plan:
    """A move of each stage."""
    good = Plan(
        np.array([NAN, 1.0]), np.array([0, 1]), np.array([30.0, 1e-3]), np.array([0.0, 2.0]), NAN
    )
    return good._replace(**columns)


MISSHAPEN = ("no programme is loaded", "load it with macromicro.programme")


@pytest.mark.parametrize("column", ["start", "stage", "target", "hold", "velocity", "acceleration"])
@pytest.mark.parametrize(
    "values",
    [
        [0.0, 1.0], np.zeros((2, 2)), np.array(["a", "b"]), np.array([None, None]),
        np.array([1j, 0j]), np.array([False, True]), np.ma.masked_array([0.0, 1.0], [True, False]),
        np.array([0.0, 1.0], dtype=np.longdouble),
    ],
)  # fmt: skip
def test_a_programme_is_made_of_columns_of_numbers(column: str, values: Any) -> None:
    assert refused(targets.plan(S, plan(**{column: values})))[:2] == MISSHAPEN


def test_what_is_no_plan_is_no_programme() -> None:
    for value in (None, tuple(plan()), 5):
        assert refused(targets.plan(S, value))[:2] == MISSHAPEN
    empty = np.array([])
    none = plan(start=empty, stage=np.array([], int), target=empty, hold=empty)
    for wrong in (none, plan(stage=np.array([0.0, 1.0]))):
        assert refused(targets.plan(S, wrong))[:2] == MISSHAPEN


@pytest.mark.parametrize("end", [NAN, 0.0, 5.0, 7])
def test_a_programme_may_have_an_end_or_none(end: float) -> None:
    found = accepted(targets.plan(S, plan(end=end)))
    assert found.kind == "programme"
    assert all(math.isnan(v) for v in (found.target, found.coarse, found.fine))


@pytest.mark.parametrize(
    ("columns", "reason"),
    [
        ({"target": np.array([1.0, 1.0, 1.0])}, "the programme's columns differ in length"),
        ({"start": np.array([NAN])}, "the programme's columns differ in length"),
        ({"velocity": np.zeros(2)}, "the programme's columns differ in length"),
        ({"acceleration": np.zeros(2)}, "the programme's columns differ in length"),
        (
            {"velocity": np.zeros(3), "acceleration": np.zeros(3)},
            "the programme's columns differ in length",
        ),
        ({"start": np.array([NAN, math.inf])}, "the programme has invalid times"),
        ({"start": np.array([-math.inf, NAN])}, "the programme has invalid times"),
        ({"end": -math.inf}, "the programme has invalid times"),
        ({"end": "x"}, "the programme has invalid times"),
        ({"end": True}, "the programme has invalid times"),
        ({"stage": np.array([0, 2])}, "the programme has moves without stage or target"),
        ({"stage": np.array([-1, 1])}, "the programme has moves without stage or target"),
        ({"target": np.array([30.0, NAN])}, "the programme has moves without stage or target"),
        ({"hold": np.array([0.0, -1e-3])}, "the programme has invalid hold times"),
        ({"hold": np.array([NAN, 1.0])}, "the programme has invalid hold times"),
        ({"hold": np.array([0.0, math.inf])}, "the programme has invalid hold times"),
        ({"target": np.array([2991.0, 1e-3])}, "a target of 2991 counts is beyond the soft limits"),
        ({"target": np.array([-131.0, 1e-3])}, "a target of -131 counts is beyond the soft limits"),
        ({"target": np.array([30.0, 3.6e-3])}, "a target of 3.6 mm is beyond the soft limits"),
        ({"target": np.array([30.0, -0.1e-3])}, "a target of -0.1 mm is beyond the soft limits"),
    ],
)
def test_a_programme_that_cannot_be_is_refused_with_its_reason(
    columns: dict[str, Any], reason: str
) -> None:
    found = refused(targets.plan(S, plan(**columns)))
    assert found.reason == reason and found.remedy
