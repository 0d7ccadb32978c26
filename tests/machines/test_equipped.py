"""An axis with switches, index pulses and drive lines, in a run: simulated and on a rig."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.machines import (
    axis,
    equipped,
    guarding,
    machine,
    open_rig,
    performing,
    period,
    planning,
    runs,
)
from macromicro.machines.guard_words import DRIVE, LIMIT_HIGH, LIMIT_LOW, LIMITS, NOT_ENABLED
from macromicro.machines.rig import CompiledTwin, Twin
from macromicro.programme import Programme
from macromicro.types import SAFE

AXIS = machine.MACHINES[0]
ALL = {
    "switches.limits": "both",
    "switches.home": "cam",
    "encoder.index_pulse": "turn",
    "amplifier.enable": "line",
    "amplifier.fault": "line",
}
LINES = ["limit_low", "limit_high", "home", "index_count", "drive_fault", "enabled", "enable"]
# Nothing else stops what runs away.
BLIND = {
    "guard.low": "-5 mm",
    "guard.high": "305 mm",
    "guard.error": "900 mm",
    "guard.speed": "90 m/s",
    "travel.low": "-4 mm",
    "travel.high": "304 mm",
}


def made(changes: dict[str, str], law: Any = None) -> tuple[Any, Any]:
    tree = axis.DEFAULT.with_(changes)
    found = machine.under(AXIS, tree)
    return (found if law is None else found._replace(law=law)), tree


def moves(targets: list[float]) -> Programme:
    """To these places in m, one after the other."""
    n, pitch = len(targets), axis.DEFAULT.encoder.pitch
    counts = np.array([round(each / pitch) for each in targets], float)
    stages = np.zeros(n, np.int64)
    return Programme("moves", np.full(n, math.nan), stages, counts, np.full(n, 0.1), math.nan, "x")


def columns(changes: dict[str, str]) -> list[str]:
    found, _ = made(changes)
    return [c.name for c in performing.columns(found)]


def test_an_axis_without_lines_is_what_it_was() -> None:
    assert equipped.kind(axis.DEFAULT) is axis.KIND
    assert not set(LINES) & set(columns({}))


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"switches.limits": "low"}, ["limit_low"]),
        ({"switches.limits": "high"}, ["limit_high"]),
        ({"switches.home": "below"}, ["home"]),
        ({"encoder.index_pulse": "mark"}, ["index_count"]),
        ({"amplifier.enable": "line"}, ["enabled", "enable"]),
        ({"amplifier.fault": "line"}, ["drive_fault"]),
        (ALL, LINES),
    ],
)
def test_a_record_has_a_column_for_each_line_that_there_is(
    changes: dict[str, str], found: list[str]
) -> None:
    assert [name for name in columns(changes) if name in LINES] == found


@pytest.mark.slow
def test_with_all_lines_it_makes_the_same_moves_compiled_interpreted_and_on_a_rig() -> None:
    plain, tree = made({})
    full, wired = made(ALL)
    plan = planning.plan(moves([0.05, 0.02]), tree)
    before = runs.record(plain, tree, plan).recording
    after = runs.record(full, wired, plan)
    assert after.outcome.finished
    for name in ("position", "effort", "true_position", "speed"):
        assert np.array_equal(before[name], after.recording[name])
    # On its way up the cam and an index pulse go by; the drive is on throughout.
    seen = after.recording
    edge, width = wired.switches.home_place, wired.switches.home_width
    on = seen["true_position"][seen["home"] == 1.0] * 1e-3
    assert edge - width - 1e-4 < on.min() and on.max() < edge + 2e-4
    assert len(on) > 10 and seen["home"][0] == 0.0
    pulses = seen["index_count"][np.isfinite(seen["index_count"])]
    expected = round(wired.encoder.index_place / wired.encoder.pitch)
    assert len(pulses) >= 1 and set(pulses.tolist()) == {float(expected)}
    assert set(seen["enable"].tolist()) == {1.0} == set(seen["enabled"].tolist())
    assert set(seen["limit_low"].tolist()) == {0.0} == set(seen["drive_fault"].tolist())
    # Any law in plain Python runs interpreted.
    slow = full._replace(law=full.law._replace(step=lambda *a: AXIS.law.step(*a)))  # noqa: PLW0108
    again = runs.record(slow, wired, plan).recording
    for name in ("position", "effort", "home", "enabled"):
        assert np.array_equal(seen[name], again[name])
    for twin in (Twin(full.kind, wired), CompiledTwin(full.kind, wired)):
        rig = runs.record(full, wired, plan, on=twin)
        assert rig.outcome.finished
        assert [n for n in LINES if n in rig.recording] == LINES
        count = min(len(seen), len(rig.recording))
        assert np.allclose(rig.recording["position"][:count], seen["position"][:count], atol=0.05)
        assert set(rig.recording["enabled"].tolist()) == {1.0}
        assert set(rig.recording["index_count"][np.isfinite(rig.recording["index_count"])]) == set(
            pulses.tolist()
        )


def wrong(sign: float) -> Any:
    """A law whose effort has the wrong sign, once it has somewhere to go."""

    def step(gains: Any, memory: Any, target: Any, sample: Any, dt: float) -> Any:
        memory, effort = AXIS.law.step(gains, memory, target, sample, dt)
        return memory, sign * abs(effort)

    return AXIS.law._replace(step=step)


@pytest.mark.parametrize(("sign", "fault"), [(-1.0, LIMIT_LOW), (1.0, LIMIT_HIGH)])
def test_what_runs_away_is_caught_by_the_limit_switch(sign: float, fault: int) -> None:
    changes = {"switches.limits": "both", **BLIND, "load.stop_low": "-40 mm"}
    changes |= {"load.stop_high": "340 mm", "guard.high": "340 mm", "guard.low": "-40 mm"}
    changes |= {"switches.low": "-10 mm", "switches.high": "310 mm"}
    found, tree = made(changes, wrong(sign))
    programme = moves([0.3 if sign < 0.0 else -0.003])
    done = runs.record(found, tree, programme)
    watch = done.outcome.watch
    place = tree.switches.low if sign < 0.0 else tree.switches.high
    assert watch.fault == fault and done.recording["effort"][-1] == 0.0
    assert done.recording["phase"][-1] == period.FAULT
    fastest = float(np.max(np.abs(done.recording["true_speed"]))) * 1e-3
    assert abs(watch.value - place) < 2e-3 * fastest + 1e-4
    assert done.recording["limit_low" if sign < 0.0 else "limit_high"][-1] == 1.0
    assert -0.04 < done.recording["true_position"][-1] * 1e-3 < 0.34  # before the end stop
    words = done.outcome.fault
    assert words is not None and "limit switch" in words.name
    # Without the switch it meets something else, or nothing.
    bare, tree = made({**changes, "switches.limits": "none"}, wrong(sign))
    assert runs.record(bare, tree, programme).outcome.watch.fault not in (LIMIT_LOW, LIMIT_HIGH)


@pytest.mark.slow
def test_the_heat_of_the_current_trips_the_drive() -> None:
    changes = {"amplifier.fault": "line", "amplifier.continuous": "1.5 A"}
    found, tree = made({**changes, "amplifier.peak_time": "0.05 s"})
    programme = moves([0.25, 0.02, 0.25])
    done = runs.record(found, tree, programme)
    assert done.outcome.watch.fault == DRIVE and done.recording["drive_fault"][-1] == 1.0
    # The heat that its current made, worked out here.
    current, heat = done.recording["motor_current"], 0.0
    slow = -0.05 / math.log(1.0 - (1.5 / tree.amplifier.current) ** 2)
    for each in current[:-1]:
        heat += (float(each) ** 2 / 1.5**2 - heat) * 1e-3 / slow
    assert heat == pytest.approx(1.0, abs=0.05)
    found, tree = made({**changes, "amplifier.peak_time": "5 s"})
    assert runs.record(found, tree, programme).outcome.finished


def held(twin: Twin, changes: dict[str, Any]) -> guarding.Watch:
    """A run on a twin during which lines change."""
    found, tree = made(ALL)
    real = twin.advance

    def advance() -> None:
        if twin.tick == 120:
            twin.injected.update(changes)
        real()

    twin.advance = advance  # type: ignore[method-assign]
    return runs.record(found, tree, moves([0.1]), on=twin).outcome.watch


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"limit_low": 1.0}, LIMIT_LOW),
        ({"limit_high": math.nan}, LIMIT_HIGH),
        ({"limit_high": 1.0, "limit_low": 1.0}, LIMITS),
        ({"drive_fault": 1.0}, DRIVE),
        ({"enabled": 0.0}, NOT_ENABLED),
        ({"home": 1.0}, 0),
    ],
)
def test_faults_of_a_rig_end_a_run(changes: dict[str, float], fault: int) -> None:
    found, tree = made(ALL)
    watch = held(Twin(found.kind, tree), changes)
    assert watch.fault == fault
    if fault:
        # The run's time began when the drive was on.
        assert watch.time == pytest.approx(0.12 - tree.amplifier.enable_time, abs=0.003)


def test_a_cut_wire_trips_a_switch_that_is_closed_while_free() -> None:
    found, tree = made(ALL)
    closed, opened = (
        Twin(found.kind, tree),
        Twin(found.kind, tree.with_("switches.contacts", "open")),
    )
    for twin in (closed, opened):
        twin.cut("limit_high")
        twin.cut("home")
    assert closed.read().limit_high == 1.0 and opened.read().limit_high == 0.0
    assert closed.read().home == 0.0


@pytest.mark.parametrize("kind", [Twin, CompiledTwin])
def test_a_twin_gives_an_effort_only_while_it_is_enabled(kind: type[Twin]) -> None:
    found, tree = made(ALL)
    twin = kind(found.kind, tree)
    assert twin.outputs == ("motor", "enable") and "enable" not in twin.channels

    def pushed(enable: float, periods: int = 40) -> float:
        before = twin.read().encoder
        for _ in range(periods):
            twin.write(open_rig.Wired(*SAFE._replace(motor=8.0), enable))
            twin.clock.wait(twin.dt)
        return twin.read().encoder - before

    with twin:
        assert pushed(0.0) == 0.0 and twin.read().enabled == 0.0
        assert pushed(1.0, 20) == 0.0  # it takes its time
        assert pushed(1.0) > 100.0 and twin.read().enabled == 1.0
        twin.injected["drive_fault"] = 1.0
        pushed(1.0, 400)
        assert abs(pushed(1.0)) < 2.0
        twin.injected.clear()
        assert pushed(1.0) > 100.0
    assert twin.read().enabled == 0.0
