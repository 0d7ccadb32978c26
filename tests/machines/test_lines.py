"""The guard of the lines: limit switches either way, the drive's fault, and the way back."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest

from macromicro.machines import guarding, lines
from macromicro.machines.guard_words import (
    DRIVE,
    FAST,
    LIMIT_HIGH,
    LIMIT_LOW,
    LIMITS,
    NOT_ENABLED,
    OK,
    TEXTS,
)
from macromicro.machines.lines import Held, Wired
from macromicro.machines.signals import Sample
from macromicro.types import QUIET

P = Wired(leave=0.1, rise=0.02)
NAN = math.nan


def watched(said, p=P, effort=0.0, held=None, dt=1e-3):
    """The guard over lines, one a period; (watch, held, effort) at the end."""
    watch, held = guarding.fresh(), held or Held()
    given = effort
    for k, each in enumerate(said):
        watch, held, given = lines.step(p, held, watch, each, Sample(1.0 + k * dt, 0.123), effort)
    return watch, held, given


LOW, HIGH = QUIET._replace(limit_low=1.0), QUIET._replace(limit_high=1.0)


@pytest.mark.parametrize("effort", [-2.0, 2.0])
def test_quiet_lines_let_everything_through(effort):
    assert watched([QUIET] * 50, effort=effort) == (guarding.fresh(), Held(1.0, 0.0, 0.0), effort)


@pytest.mark.parametrize("value", [1.0, NAN, 0.5])
@pytest.mark.parametrize(
    ("name", "fault"),
    [("limit_low", LIMIT_LOW), ("limit_high", LIMIT_HIGH), ("drive_fault", DRIVE)],
)
def test_what_trips_is_a_fault_at_once_and_stays(name, fault, value):
    tripped = QUIET._replace(**{name: value})
    watch, held, effort = watched([QUIET, tripped], effort=2.0)
    assert (watch.fault, watch.time, effort) == (fault, 1.001, 0.0) and watch.value == 0.123
    again = lines.step(P, held, watch, QUIET, Sample(1.1, 0.0), 2.0)
    assert again == (watch, held, 0.0)


def test_a_fault_keeps_what_the_guard_of_the_stage_has_seen():
    seen = guarding.fresh()._replace(
        heard=0.5, place=0.1, since=0.4, there=0.2, pushed=0.3, stood=7.0
    )
    watch, _, _ = lines.step(P, Held(0.0), seen, LOW, Sample(1.0, 0.2), 1.0)
    assert watch == seen._replace(fault=LIMIT_LOW, value=0.2, limit=0.0, time=1.0)


def test_both_limit_switches_at_once_are_a_wire_and_not_a_place():
    both = LOW._replace(limit_high=1.0)
    for p in (P, P._replace(homing=1)):
        for said in ([both], [QUIET, both], [LOW, both]):
            assert watched(said, p)[0].fault == LIMITS


def test_a_drive_fault_comes_before_what_follows_from_it():
    said = LOW._replace(drive_fault=1.0, enabled=0.0)
    assert watched([QUIET, said])[0].fault == DRIVE
    assert watched([said])[0].fault == DRIVE


@pytest.mark.parametrize(("said", "way"), [(LOW, -1.0), (HIGH, 1.0)])
def test_a_switch_that_was_tripped_lets_the_stage_leave_and_no_farther(said, way):
    watch, held, effort = watched([said] * 20, effort=2.0 * way)
    assert (watch.fault, effort) == (OK, 0.0)
    assert (held.low, held.high) == ((1.0, 0.0) if way < 0.0 else (0.0, 1.0))
    assert watched([said] * 20, effort=-2.0 * way)[2] == -2.0 * way
    # Once it has let go, it trips again.
    assert watched([said, QUIET, said])[0].fault == (LIMIT_LOW if way < 0.0 else LIMIT_HIGH)
    # The other one is a fault all the while.
    other = QUIET._replace(limit_low=float(way > 0.0), limit_high=float(way < 0.0))
    assert watched([said, other])[0].fault == (LIMIT_HIGH if way < 0.0 else LIMIT_LOW)


def test_homing_looks_for_the_lower_switch_and_not_for_the_upper():
    homing = P._replace(homing=1)
    watch, held, effort = watched([QUIET, LOW, LOW], homing, effort=-2.0)
    assert (watch.fault, effort, held.low) == (OK, -2.0, 1.0)
    assert watched([QUIET, HIGH], homing)[0].fault == LIMIT_HIGH
    assert watched([HIGH], homing, effort=2.0)[2] == 0.0
    # A homing that was stopped on the switch leaves it as any other.
    watch, held, effort = lines.step(P, held, watch, LOW, Sample(2.0, 0.0), -2.0)
    assert (watch.fault, effort) == (OK, 0.0)
    watch, held, _ = lines.step(P, held, watch, QUIET, Sample(2.0, 0.0), 0.0)
    assert lines.step(P, held, watch, LOW, Sample(2.0, 0.0), 0.0)[0].fault == LIMIT_LOW


def test_a_drive_that_says_it_is_off_is_given_its_time():
    off = QUIET._replace(enabled=0.0)
    assert watched([off] * 21)[0].fault == OK
    watch, _, effort = watched([off] * 22, effort=1.0)
    assert (watch.fault, watch.limit, effort) == (NOT_ENABLED, 0.02, 0.0)
    assert watch.value == pytest.approx(0.021)
    assert watched([QUIET] * 30 + [off])[0].fault == NOT_ENABLED
    assert watched([QUIET] * 30 + [QUIET._replace(enabled=NAN)])[0].fault == NOT_ENABLED


def test_off_a_switch_the_guard_allows_little_speed():
    limits = guarding.Limits(speed=2.0)
    for held in (Held(0.0, 1.0, 0.0), Held(0.0, 0.0, 1.0)):
        assert lines.bounded(limits, P, held) == limits._replace(speed=0.1)
        assert lines.bounded(limits._replace(speed=0.05), P, held).speed == 0.05
        assert lines.bounded(limits, P._replace(homing=1), held) == limits
    assert lines.bounded(limits, P, Held(0.0)) == limits
    assert lines.unbounded(limits, P, Held(0.0, 1.0, 1.0)) == limits


def test_a_stage_without_lines_is_not_watched():
    both = LOW._replace(limit_high=1.0)
    fresh = guarding.fresh()
    assert lines.unwatched(P, Held(), fresh, both, Sample(0.0, 0.0), 3.0) == (fresh, Held(), 3.0)
    assert str(lines.none(None, None)) == str(QUIET)
    assert lines.as_it_is(None, 7, 0.0) == 7


@pytest.mark.parametrize("fault", range(LIMIT_LOW, NOT_ENABLED + 1))
def test_each_has_its_words(fault):
    watch = guarding.fresh()._replace(fault=fault, value=0.25, limit=0.02, time=1.5)
    found = guarding.describe(watch)
    assert found is not None and found.code == fault and "at 1.5000 s" in found.evidence
    assert found.remedy and found.message.endswith(".")
    assert len({text.name for text in TEXTS.values()}) == len(TEXTS)
    if fault in (LIMIT_LOW, LIMIT_HIGH, LIMITS):
        assert "250.0000 mm" in found.evidence


def test_what_is_allowed_follows_from_any_machines_settings():
    motion = SimpleNamespace(velocity=0.5)
    plain = SimpleNamespace(motion=motion)
    assert lines.wiring(plain) == (pytest.approx(0.1), 0.0, 0)
    switches, amplifier = SimpleNamespace(leave=0.02), SimpleNamespace(enable_time=0.03)
    own = SimpleNamespace(motion=motion, switches=switches, amplifier=amplifier)
    assert lines.wiring(own) == (pytest.approx(0.04), 0.03, 0)
    assert Wired().rise == 0.0
    assert lines.leaving(own) == 0.02 and lines.leaving(plain) == pytest.approx(0.05)


def test_lines_of_a_sample_and_as_they_are_shown():
    sample = SimpleNamespace(limit_low=1, index_count=5.0, encoder=3.0)
    found = lines.read_lines(sample, ("encoder", "limit_low", "index_count"))
    assert found == QUIET._replace(limit_low=1.0, index_count=5.0)
    assert str(lines.read_lines(sample, ("encoder",))) == str(QUIET)
    shown = lines.visible_lines(found, ("limit_low",))
    assert shown.limit_low == 1.0 and all(math.isnan(v) for v in shown[1:])
    assert lines.of(("enable", "encoder", "home", "limit_low")) == ("limit_low", "home", "enable")


def test_overspeed_off_a_switch_is_told_as_such():
    assert "limit switch" in TEXTS[FAST].remedy
