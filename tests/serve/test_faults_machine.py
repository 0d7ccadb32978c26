"""Sensors, actuators, carriage and clock that fail while the machine moves: outputs safe,
latched, told with cause and remedy, and nothing recorded before it lost."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest
from fault_parts import CLIENT, Scene, note

import faulty
from macromicro.control.live import messages as m
from macromicro.control.live.messages import Refused
from macromicro.control.live.parameters import Edges
from macromicro.control.pid import Pid
from macromicro.control.settings import Control
from macromicro.rig import codes
from macromicro.rig.limits import LIVE
from macromicro.serve import faults
from tests.waiting import until

Make = Callable[..., Scene]
PITCH = 0.2 / 2800.0
STEP = 1  # a fault is judged in the period that shows it; ages count from the next one


class Case(NamedTuple):
    """What moves, how far it has come when the fault comes [counts | mm], which faults may be
    found and by when at the latest [ms]."""

    request: m.Request
    place: float
    found: tuple[int, ...]
    within: float


HALL_AWAY = (codes.HALL_RANGE, codes.HALL_NOISY, codes.MICRO_LOST)
MACRO, MICRO = m.MoveMacro(1500), m.MoveMicro(1.5e-3)
LEANT = 1e3 * (LIVE.leant + 0.05)
CASES = {
    "encoder-frozen": Case(MACRO, 20.0, (codes.STUCK, faults.LOST_COUNTS), LEANT),
    "encoder-reversed": Case(
        MACRO, 20.0, (codes.MACRO_LOST, codes.ENCODER_AGAINST, faults.LOST_COUNTS), 500.0
    ),
    "encoder-skipping": Case(MACRO, 20.0, (faults.LOST_COUNTS,), 500.0),
    "encoder-jump": Case(MACRO, 20.0, (codes.ENCODER_JUMP,), 0.0),
    "encoder-silent": Case(MACRO, 20.0, (codes.ENCODER_SILENT,), 1e3 * LIVE.silent + STEP),
    "hall-stuck": Case(MICRO, 0.3, (codes.HALL_FROZEN,), 1e3 * LIVE.frozen + STEP),
    "hall-range": Case(MICRO, 0.3, HALL_AWAY, 1e3 * LIVE.rail_time + 3),
    "hall-low": Case(MICRO, 0.3, HALL_AWAY, 1e3 * LIVE.rail_time + 3),
    "hall-noisy": Case(MICRO, 0.3, (codes.HALL_NOISY,), 100.0),
    "hall-silent": Case(MICRO, 0.3, (codes.HALL_SILENT,), 1e3 * LIVE.silent + STEP),
    "wire-broken": Case(MICRO, 0.3, (codes.NO_MOTION, codes.TOO_HOT, codes.MICRO_LOST), 3000.0),
    "carriage-stuck": Case(MACRO, 20.0, (codes.STUCK,), LEANT),
    "motor-dead": Case(MACRO, 20.0, (codes.STUCK,), LEANT),
    "clock-ahead": Case(MACRO, 20.0, (codes.CLOCK,), 0.0),
    "clock-stands": Case(MACRO, 20.0, (codes.CLOCK_STANDS,), 1e3 * LIVE.clock + STEP),
    "clock-none": Case(MICRO, 0.3, (codes.CLOCK_STANDS,), 1e3 * LIVE.clock + STEP),
    "clock-back": Case(MICRO, 0.3, (codes.CLOCK,), 0.0),
}
QUICK = ("encoder-frozen", "encoder-skipping", "hall-noisy", "wire-broken", "clock-ahead")


def under_way(scene: Scene, request: m.Request, place: float) -> int:
    """The number of a motion that has come that far."""
    motion = scene.ask(request)
    cell, scale = faulty.CARRIAGE, 1.0 / PITCH
    if isinstance(request, m.MoveMicro):
        rest = float(scene.cells[faulty.CARRIAGE])
        until(lambda: (scene.cells[faulty.STAGE] - rest) * 1e3 >= place)
    else:
        until(lambda: scene.cells[cell] * scale >= place)
    return motion


@pytest.mark.parametrize(
    "name", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in CASES]
)
def test_what_fails_on_the_way_is_stopped_and_told(name: str, scene: Make) -> None:
    case = CASES[name]
    bench = scene()
    motion = under_way(bench, case.request, case.place)
    bench.inject(name)
    fault = bench.fault()
    assert bench.end(motion).outcome == "fault"
    assert fault.code in case.found
    assert fault.message.endswith(".") and "all outputs were set to off" in fault.evidence
    assert ("live.edges." if fault.code == faults.LOST_COUNTS else "guard.") in fault.remedy
    now = bench.station.snapshot()
    assert (now.mode, now.motor_v, now.ctrl_v, now.fan) == ("fault", 0.0, 0.0, False)
    until(lambda: bench.cells[faulty.SAFE_AT] >= 0.0)
    run = bench.run()
    safety = bench.safety(run)
    assert safety.milliseconds <= case.within
    assert run["fault"][safety.rows - 1] == 0 and run["fault"][-1] == fault.code
    assert bench.cells[faulty.ILLEGAL] == 0
    note(name, safety.milliseconds, f"0 V, {safety.travel:.1f} mm on", fault.message)
    bench.latched()
    refused = bench.station.request(CLIENT, m.MoveTo(0.02))
    assert isinstance(refused, Refused) and "home" in refused.remedy


def test_a_controller_that_gives_no_number_is_stopped(scene: Make) -> None:
    # Beyond the bounds of all that a person may set: inf - inf is no number.
    bench = scene(controller=Control(macro_law="pid", pid=Pid(1e308, 0.0, -1e308)))
    motion = bench.ask(m.MoveMacro(300))
    fault = bench.fault()
    assert bench.end(motion).outcome == "fault"
    assert fault.code == codes.ILLEGAL
    assert "nan V" in fault.evidence and "gains" in fault.remedy
    run = bench.run()
    assert np.all(run["motor"] == 0.0)  # it never got out
    assert bench.cells[faulty.ILLEGAL] == 0
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    note("NaN from a controller", 0, "0 V, the NaN got nowhere", fault.message)
    bench.latched()


def test_a_lost_laser_stops_nothing_and_is_told(scene: Make) -> None:
    bench = scene()
    motion = under_way(bench, MICRO, 0.3)
    bench.inject("laser-lost")
    assert bench.end(motion).outcome == "done"
    assert bench.station.snapshot().fault is None
    onset = float(bench.cells[faulty.ONSET])
    bench.inject("none")
    told = until(lambda: [e for e in bench.station.events()[1] if e.kind == "sensor"][:2])
    until(lambda: len([e for e in bench.station.events()[1] if e.kind == "sensor"]) == 2)
    told = [e for e in bench.station.events()[1] if e.kind == "sensor"]
    assert [e.cause for e in told] == ["laser lost", "laser back"]
    assert "beam" in told[0].evidence["remedy"]
    run = bench.run()
    before = round((onset - run["t"][0]) * 1e3)
    assert np.all(np.isfinite(run["laser"][:before])) and math.isnan(run["laser"][before])
    note("laser-lost", round((told[0].time - onset) * 1e3), "goes on", "event: laser lost")


@pytest.mark.slow
def test_a_lost_fan_is_not_seen_and_harms_nothing(scene: Make) -> None:
    """No sensor tells of it: the way out only takes longer, and says so in its seconds."""
    bench = scene()
    bench.ask(m.Fan(True))
    assert bench.end(bench.ask(m.MoveMicro(3e-3))).outcome == "done"
    bench.inject("fan-lost")
    back = bench.end(bench.ask(m.MoveMicro(0.5e-3)))
    assert back.outcome in ("done", "stalled")
    now = bench.station.snapshot()
    assert now.fault is None and now.fan
    note("fan-lost", math.nan, f"goes on; {back.evidence['seconds']:.1f} s", "nothing")


@pytest.mark.slow
def test_without_a_laser_homing_tells_the_counts_lost(scene: Make) -> None:
    """Then an encoder has no witness: "done" is where its counts say, not where it is."""
    bench = scene(live={"edges": Edges(use=0)})
    bench.inject("encoder-skipping")
    moved = bench.end(bench.ask(m.MoveMacro(300)))
    bench.inject("none")
    assert moved.outcome == "done"
    off = bench.cells[faulty.CARRIAGE] / PITCH - moved.position / PITCH
    assert off == pytest.approx(300 / 9, abs=6.0)
    homed = bench.end(bench.ask(m.Home()))
    assert homed.outcome == "done"
    assert homed.evidence["shift_counts"] == pytest.approx(-off, abs=6.0)
    note(
        "encoder-skipping, no laser",
        math.nan,
        f"goes on, {off:.0f} counts off",
        "at the next homing",
    )


def test_a_rig_that_fails_ends_the_loop_and_keeps_all_that_was_recorded(scene: Make) -> None:
    bench = scene()
    motion = under_way(bench, MACRO, 20.0)
    bench.inject("unplugged")
    assert bench.end(motion).outcome == "fault"
    fault = bench.fault()
    assert fault.code == faults.RIG_FAILED
    assert "the A/D board was unplugged" in fault.evidence and "opens the rig again" in fault.remedy
    until(lambda: bench.cells[faulty.SAFE_AT] >= 0.0)
    late = round((bench.cells[faulty.SAFE_AT] - bench.cells[faulty.ONSET]) * 1e3)
    assert late <= 1
    run = bench.run()
    assert run["t"][-1] == pytest.approx(bench.cells[faulty.ONSET] - 1e-3, abs=1e-6)
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    note(
        "unplugged",
        late,
        "0 V, the loop process ends; a new one once the rig answers",
        fault.message,
    )


def test_a_rig_that_blocks_is_stopped_and_nothing_is_known_any_more(scene: Make) -> None:
    bench = scene(loop_timeout=0.5)
    motion = under_way(bench, MACRO, 20.0)
    bench.inject("hanging")
    assert bench.end(motion).outcome == "fault"
    now = bench.station.snapshot()
    assert now.fault is not None and now.fault.code == faults.LOOP_SILENT
    assert not now.trusted and math.isinf(now.uncertainty_m)
    until(lambda: bench.cells[faulty.SAFE_AT] >= 0.0)
    late = 1e-6 * float(bench.cells[faulty.SAFE_NS] - bench.cells[faulty.ONSET_NS])
    run = bench.run()
    assert "no period for" in str(run.attributes["ended"])
    note("hanging", round(late), "as told last, then 0 V, the loop process ends", now.fault.message)


@pytest.mark.slow
def test_a_slow_rig_is_stopped_for_lateness(scene: Make) -> None:
    bench = scene(miss_share=0.1, miss_window=0.5)
    motion = under_way(bench, MACRO, 20.0)
    bench.inject("slow")
    assert bench.end(motion).outcome == "fault"
    fault = bench.fault()
    assert fault.code == faults.LATE and "doctor" in fault.remedy
    until(lambda: bench.cells[faulty.SAFE_AT] >= 0.0)
    late = 1e-6 * float(bench.cells[faulty.SAFE_NS] - bench.cells[faulty.ONSET_NS])
    bench.inject("none")
    until(lambda: bench.station.snapshot().mode == "fault")
    run = bench.run()
    first = int(np.flatnonzero(run["fault"] == faults.LATE)[0])
    assert np.all(run["motor"][first:] == 0.0)
    assert np.array_equal(np.diff(np.round(run["t"] * 1e3)), np.ones(run.rows - 1))
    note("slow", late, "0 V", fault.message)
