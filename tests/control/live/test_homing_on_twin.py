"""Homing on the twin: friction, rubber and rigid stops, carriages held up."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.control.live._homing import GIVE
from macromicro.control.live.messages import Accepted
from macromicro.control.live.parameters import Homing
from macromicro.rig.codes import OK, STUCK
from macromicro.rig.limits import LIVE
from macromicro.rules import LEANS
from macromicro.settings import Settings

from .bench import DT, PITCH, Bench
from .follower import QUICK

STOP_LOW = Settings().bench.carriage.stop_low


def bench(
    place: float, friction: float = 1.0, stiffness: float = 0.0, seed: int = 0, **begun: Any
) -> Bench:
    """On the twin with a live guard, enabled, `place` [m] above the end of its way; with a
    share of the default friction, and another stiffness of the stop [N/m]."""
    q = Settings()
    rubs, rail = q.bench.friction, q.bench.carriage
    rubs = rubs._replace(coulomb=friction * rubs.coulomb, stribeck=friction * rubs.stribeck)
    rail = rail._replace(stop_stiffness=stiffness or rail.stop_stiffness)
    q = q._replace(bench=q.bench._replace(friction=rubs, carriage=rail), guard=LIVE)
    b = Bench(rail.stop_low + place, seed, q, **begun)
    b.tick()
    b.ask(m.Enable())
    return b


@pytest.mark.parametrize(("friction", "stiffness"), [(0.4, 5e7), (1.08, 0.0)])
def test_homing_from_the_stop_and_beside_it(friction: float, stiffness: float) -> None:
    """Pressed against it or some millimetres away, rubber or rigid: the guard is content."""
    for seed, place in enumerate((0.0 if stiffness else -5e-5, 1e-4, 5e-3)):
        b = bench(place, friction, stiffness, seed)
        b.ask(m.Home())
        end = b.wait(20.0)
        assert (end.outcome, b.watch.fault) == ("done", OK), (place, end)
        found = (end.evidence["stop_raw_counts"] + 0.5) * PITCH
        assert -0.3e-3 <= found - Settings().bench.carriage.stop_low <= PITCH
        assert b.leant <= LEANS * LIVE.leant
    b.ask(m.Home())  # from where it is left
    assert b.wait(20.0).outcome == "done"


@pytest.mark.parametrize("after", [pytest.param(1.2, marks=pytest.mark.slow), 1.6])
def test_homing_again_from_the_push_against_the_stop(after: float) -> None:
    b = bench(5e-3)
    b.ask(m.Home())
    b.run(after)
    b.ask(m.EmergencyStop())
    b.ask(m.Enable())
    b.ask(m.Home())
    assert (b.wait(20.0).outcome, b.watch.fault) == ("done", OK)


@pytest.mark.parametrize("friction", [pytest.param(1.1, marks=pytest.mark.slow), 1.6])
def test_a_carriage_that_cannot_be_moved_is_never_homed(friction: float) -> None:
    """The push cannot break it away; nor can it be backed off then."""
    for seed, place in enumerate((0.0, 5e-3)):
        b = bench(place, friction, seed=seed)
        b.ask(m.Home())
        assert b.wait(60.0).outcome in ("fault", "stalled")
        assert not b.s.frame.trusted


def on_its_way() -> Bench:
    """Homing, half of the 10 mm to the stop gone."""
    b = bench(10e-3)
    b.ask(m.Home())
    while b.twin.truth().carriage > STOP_LOW + 5e-3:
        b.tick()
    return b


@pytest.mark.parametrize(
    "jammed", [0.1, *(pytest.param(s, marks=pytest.mark.slow) for s in (0.3, 0.5, 0.7)), 0.9]
)
def test_a_moments_jam_is_no_stop(jammed: float) -> None:
    b = on_its_way()
    here = b.twin.state.macro
    for _ in range(round(jammed / DT)):
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    end = b.wait(20.0)
    assert end.outcome == "done"
    assert end.evidence["stop_raw_counts"] * PITCH < Settings().bench.carriage.stop_low
    found = [e.evidence["stop_raw_counts"] for e in b.events if e.cause == "end stop found"]
    sure = [e.evidence["stop_raw_counts"] for e in b.events if e.cause == "end stop confirmed"]
    assert len(found) == (2 if jammed > 2.0 * Homing().stand else 1) and len(sure) == 1
    assert abs(found[-1] - sure[0]) <= GIVE


def test_a_carriage_held_up_until_it_is_backed_off_goes_on_to_the_stop() -> None:
    b = on_its_way()
    here = b.twin.state.macro
    while not [e for e in b.events if e.cause == "end stop found"]:
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    end = b.wait(20.0)
    assert (end.outcome, b.watch.fault) == ("done", OK)
    assert end.evidence["stop_raw_counts"] * PITCH < Settings().bench.carriage.stop_low


def test_a_carriage_that_stays_held_up_is_never_homed() -> None:
    b = on_its_way()
    here = b.twin.state.macro
    while not b.ends:
        b.tick()
        b.twin.state = b.twin.state._replace(macro=here._replace(v=0.0, i=0.0))
    assert b.ends[-1].outcome == "fault" and b.watch.fault == STUCK
    assert not b.s.frame.trusted


def test_the_guard_is_content_with_the_push() -> None:
    """On the twin the carriage is pushed against the stop for longer than it may be stuck."""
    b = Bench(-9.9e-3, live=QUICK._replace(homing=QUICK.homing._replace(stand=0.4, patience=5.0)))
    b.tick()
    b.ask(m.Enable())
    assert isinstance(b.ask(m.Home()), Accepted)
    assert b.wait(5.0).outcome == "done"


@pytest.mark.parametrize(
    ("place", "known", "most"),
    [
        (224e-3, False, 6.7),
        (224e-3, True, 5.4),
        pytest.param(10e-3, False, 3.5, marks=pytest.mark.slow),
        pytest.param(110e-3, False, 5.0, marks=pytest.mark.slow),
        pytest.param(10e-3, True, 3.7, marks=pytest.mark.slow),
    ],
)
def test_homing_takes_seconds_from_anywhere(place: float, known: bool, most: float) -> None:
    begun = {"coordinate": (STOP_LOW + place) / PITCH, "trusted": True} if known else {}
    b = bench(place, **begun)
    b.ask(m.Home())
    end = b.wait(most)
    assert (end.outcome, b.watch.fault) == ("done", OK)
    assert end.evidence["by"] == "laser"


def tried(seed: int) -> tuple[float, str]:
    """Homing from a drawn place, with a drawn friction, stop and knowledge, right or wrong: the
    friction's factor and the outcome; that it is no false home is checked here."""
    rng = np.random.default_rng(seed)
    place, friction = rng.uniform(0.0, 0.2243), rng.uniform(0.9, 1.1)
    told = (STOP_LOW + place) / PITCH + rng.choice([0.0, rng.uniform(-1500.0, 1500.0)])
    begun: dict[str, Any] = {"coordinate": told, "trusted": bool(rng.integers(2))}
    b = bench(place, friction, float(rng.choice([0.0, 5e7])), seed, **rng.choice([{}, begun]))
    b.ask(m.Home())
    outcome = b.wait(50.0).outcome
    assert b.s.frame.trusted == (outcome == "done")
    if outcome == "done":
        felt = b.ends[-1].evidence["stop_raw_counts"]
        assert -0.3e-3 <= (felt + 0.5) * PITCH - STOP_LOW <= PITCH, (seed, felt)
        assert b.s.frame.offset == felt + Homing().back_off
    assert b.leant <= LEANS * LIVE.leant or outcome != "done"
    return friction, outcome


MOVABLE = 1.08  # of the default friction: beyond it the push may not break the carriage away


@pytest.mark.parametrize("seed", range(2))
def test_no_false_home_and_no_fault(seed: int) -> None:
    friction, outcome = tried(seed)
    assert outcome == "done" or friction > MOVABLE


@pytest.mark.slow
def test_no_false_home_and_no_fault_in_many_places() -> None:
    found = [tried(seed) for seed in (*range(2, 5), *range(100, 160))]
    assert [x for x in found if x[1] != "done" and x[0] <= MOVABLE] == []
    assert sum(outcome == "done" for _, outcome in found) >= 50
