"""The guard period by period: each output alone, each envelope, the latch, the heat."""

from __future__ import annotations

import math

import pytest

from macromicro.control import calibration
from macromicro.models import electrothermal
from macromicro.models.electrothermal import Heating
from macromicro.rig import codes, guard
from macromicro.rig.envelope import Bounds
from macromicro.rig.guard import Heat, Watch
from macromicro.rig.limits import Limits
from macromicro.settings import Settings
from macromicro.types import SAFE, Command, Outputs, Sample

DT = 1e-3
LIMITS = Limits(motor=4.0, ctrl=3.0)
TABLE = calibration.default_calibration()
P = guard.prepare(LIMITS, TABLE)
QUIET = Command(0.0, 0.0, 0.0, 0.0, 0.0)
FINE = Outputs(1.0, 1.5, 1.0, 0.0)
NAN = math.nan


def sample(k: int, volts: float = 2.0, count: float = 0.0) -> Sample:
    return Sample(k * DT, count, volts + 1e-3 * (k % 2), NAN, NAN, NAN)


def run(
    out: Outputs, periods: int, watch: Watch | None = None, command: Command = QUIET, first: int = 0
) -> tuple[Watch, Outputs, int]:
    """State, outputs and the period in which it tripped (-1: never)."""
    watch = guard.fresh() if watch is None else watch
    given, tripped = SAFE, -1
    for k in range(first, first + periods):
        watch, given = guard.step(P, watch, sample(k), command, out, DT)
        if watch.fault != codes.OK and tripped < 0:
            tripped = k
    return watch, given, tripped


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *[("motor", v) for v in (4.01, -4.01, NAN, math.inf, -math.inf)],
        *[("ctrl", v) for v in (3.01, -0.01, NAN, math.inf)],
        *[("fan", v) for v in (0.5, 2.0, -1.0, NAN, math.inf)],
        *[("laser_reset", v) for v in (0.5, 2.0, -1.0, NAN, math.inf)],
    ],
)
def test_each_output_alone_is_enough(name: str, value: float) -> None:
    out = FINE._replace(**{name: value})
    watch, given, tripped = run(out, 3)
    assert (watch.fault, given, tripped) == (codes.ILLEGAL, SAFE, 0)
    shown, limit = (out.motor, 4.0) if name == "motor" else (out.ctrl, 3.0)
    assert watch.limit == limit
    assert watch.value == shown or math.isnan(shown)


@pytest.mark.parametrize(
    "out",
    [
        Outputs(4.0, 3.0, 1.0, 1.0),
        Outputs(-4.0, 0.0, 0.0, 0.0),
        Outputs(0.0, 1.0, 1.0, 0.0),
        Outputs(0.0, 1.0, 0.0, 1.0),
    ],
)
def test_what_is_legal_passes_as_it_is(out: Outputs) -> None:
    watch, given, _ = run(out, 2)
    assert watch.fault == codes.OK and given == out


def test_a_fault_stays_as_it_was_found_and_so_do_the_outputs() -> None:
    watch, _, _ = run(FINE._replace(motor=9.0), 1, first=7)
    found = watch[:4]
    assert found == (codes.ILLEGAL, 9.0, 4.0, 0.007)
    for first in (8, 50):
        watch, given, _ = run(FINE, 40, watch, first=first)
        assert watch[:4] == found and given == SAFE
    later, _, _ = run(FINE._replace(ctrl=9.0), 5, watch, first=90)
    assert later[:4] == found  # the first one stays


def test_a_latched_fault_leaves_the_wires_cold() -> None:
    """What is not let through heats nothing, and neither does what is illegal."""
    watch, _, _ = run(FINE._replace(fan=0.5), 1)
    assert watch.heat.heating == Heating(0.0, 0.0, 0.0)
    watch, _, _ = run(FINE, 200, watch, first=1)
    assert guard.temperature(LIMITS, watch) == 25.0
    warm, _, _ = run(FINE, 200)
    assert guard.temperature(LIMITS, warm) > 26.0


def test_the_heat_is_counted_from_the_room_of_the_settings() -> None:
    """60 K of heating are 85 degC in a room of 25 degC and 100 degC in one of 40 degC."""
    for ambient, fault in ((25.0, codes.OK), (40.0, codes.TOO_HOT)):
        settings = Settings().with_(
            {"bench.thermal.ambient": f"{ambient} degC", "guard.hottest": "95 degC"}
        )
        p = guard.prepare(settings.guard, TABLE)
        watch = guard.fresh()._replace(heat=Heat(heated(60.0), NAN, 0.0))
        watch, _ = guard.step(p, watch, sample(0), QUIET, SAFE, DT)
        assert watch.fault == fault
        assert guard.temperature(p.limits, watch) == pytest.approx(ambient + 60.0, abs=0.1)
        if fault:
            assert (watch.value, watch.limit) == (pytest.approx(100.0, abs=0.1), 95.0)


def test_the_bounds_come_from_the_limits_in_counts_and_metres() -> None:
    q = Limits(
        macro_margin=11.0,
        macro_tolerance=12.0,
        macro_rate=13.0,
        macro_grace=14.0,
        micro_margin=1e-3,
        micro_tolerance=2e-3,
        micro_rate=3e-3,
        micro_grace=4.0,
    )
    p = guard.prepare(q, TABLE)
    assert p.macro == Bounds(11.0, 12.0, 13.0, 14.0)
    assert p.micro == pytest.approx(Bounds(1e-3, 2e-3, 3e-3, 4.0))
    assert p.limits is q and p.calibration is TABLE


def test_a_carriage_that_does_not_follow() -> None:
    """460 counts are allowed for 0.5 s; then 500 count/s fewer: 400 after 0.12 s more."""
    command = Command(400.0, 1.0, 0.0, 0.0, 0.0)
    watch, given, tripped = run(Outputs(1.0, 0.0, 0.0, 0.0), 900, command=command)
    assert (watch.fault, watch.value, given) == (codes.MACRO_LOST, 400.0, SAFE)
    assert tripped == pytest.approx(621, abs=2)
    assert watch.limit == pytest.approx(400.0, abs=0.6)
    for sign in (1.0, -1.0):
        aside = Command(sign * 9e3, 0.0, 0.0, 0.0, 0.0)
        assert run(Outputs(1.0, 0.0, 0.0, 0.0), 900, command=aside)[2] == -1
    below = Command(-400.0, 1.0, 0.0, 0.0, 0.0)
    assert run(Outputs(1.0, 0.0, 0.0, 0.0), 900, command=below)[2] == tripped
    near = Command(150.0, 1.0, 0.0, 0.0, 0.0)
    assert run(Outputs(1.0, 0.0, 0.0, 0.0), 900, command=near)[2] == -1


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_micro_stage_that_does_not_follow(side: float) -> None:
    """0.3 mm more than at the start for 1.5 s; then 0.5 mm/s less: gone after 0.6 s more."""
    place = calibration.position(TABLE, 2.0)
    command = Command(0.0, 0.0, place + side * 1e-3, 1.0, place)
    watch, given, tripped = run(Outputs(0.0, 0.0, 0.0, 0.0), 2500, command=command)
    assert (watch.fault, given) == (codes.MICRO_LOST, SAFE)
    assert tripped == pytest.approx(2100, abs=12)
    assert watch.value == pytest.approx(1e-3, abs=5e-6)
    near = Command(0.0, 0.0, place + side * 0.69e-3, 1.0, place)
    assert run(Outputs(0.0, 0.0, 0.0, 0.0), 3000, command=near)[2] == -1
    aside = Command(0.0, 0.0, place + side * 1e-3, 0.0, place)
    assert run(Outputs(0.0, 0.0, 0.0, 0.0), 3000, command=aside)[2] == -1


def heated(kelvin: float) -> Heating:
    """Heating that is estimated as so many kelvin above room."""
    s = Heating(0.0, 0.0, 0.0)
    unit = electrothermal.temperature(Heating(1.0, 1.0, 1.0))
    return s._replace(**dict.fromkeys(s._fields, kelvin / unit))


def test_the_heat_at_which_it_trips() -> None:
    for kelvin, code in ((144.9, codes.OK), (145.1, codes.TOO_HOT)):
        found = guard._heat_fault(LIMITS, Heat(heated(kelvin), 0.0, 0.0))
        assert found[0] == code
        if code:
            assert found[1:] == (pytest.approx(25.0 + kelvin), 170.0)
    assert guard._heat_fault(LIMITS, Heat(heated(100.0), 0.0, 0.5))[0] == codes.OK
    idle = guard._heat_fault(LIMITS, Heat(heated(100.0), 0.0, 0.51))
    assert idle == (codes.NO_MOTION, pytest.approx(125.0), 0.51)


@pytest.mark.parametrize(
    ("kelvin", "wanted", "place", "idle", "anchor"),
    [
        (96.0, True, 1.04e-3, 0.301, 1e-3),  # hot, wanted, not 50 um from where it last moved
        (96.0, True, 0.96e-3, 0.301, 1e-3),
        (96.0, True, 1.06e-3, 0.0, 1.06e-3),
        (96.0, True, 0.94e-3, 0.0, 0.94e-3),
        (96.0, False, 1e-3, 0.0, 1e-3),
        (94.0, True, 1.04e-3, 0.0, 1.04e-3),  # not hot
    ],
)
def test_heating_without_motion(
    kelvin: float, wanted: bool, place: float, idle: float, anchor: float
) -> None:
    # CTRL that keeps this heat is not at hand: one period changes it by far less than 1 K.
    s = guard._warm(LIMITS, Heat(heated(kelvin), 1e-3, 0.3), 0.0, wanted, place, DT)
    assert (s.idle, s.anchor) == (pytest.approx(idle), anchor)
    first = guard._warm(LIMITS, Heat(heated(kelvin), NAN, 0.3), 0.0, wanted, place, DT)
    assert (first.idle, first.anchor) == (0.0, place)


@pytest.mark.parametrize(("ahead", "counts"), [(0.06e-3, True), (0.04e-3, False), (-0.2e-3, False)])
def test_only_a_contraction_that_is_wanted_and_lacks_counts_as_idle(
    ahead: float, counts: bool
) -> None:
    place = calibration.position(TABLE, 2.0)
    watch = guard.fresh()._replace(heat=Heat(heated(97.0), place, 0.1))
    command = Command(0.0, 0.0, place + ahead, 1.0, place)
    watch, _ = guard.step(P, watch, sample(0), command, SAFE, DT)
    assert (watch.heat.idle > 0.1) == counts
    watch = guard.fresh()._replace(heat=Heat(heated(97.0), place, 0.1))
    watch, _ = guard.step(P, watch, sample(0), command._replace(micro_active=0.0), SAFE, DT)
    assert watch.heat.idle == 0.0


@pytest.mark.parametrize("ahead", [400.0, -400.0])
def test_the_error_is_counted_from_where_the_carriage_is(ahead: float) -> None:
    watch = guard.fresh()
    command = Command(1000.0 + ahead, 1.0, 0.0, 0.0, 0.0)
    for k in range(700):
        watch, _ = guard.step(P, watch, sample(k, count=1000.0), command, SAFE, DT)
    assert (watch.fault, watch.value) == (codes.MACRO_LOST, 400.0)


def test_of_two_faults_at_once_the_cause_is_told() -> None:
    """A sensor's before what follows of it, and that before the heat."""
    place = calibration.position(TABLE, 2.0)
    far = Command(9e3, 1.0, place + 9e-3, 1.0, place)
    for k, seen in ((0, {"jump": 9.0}), (1, {})):
        watch = guard.fresh()._replace(
            heat=Heat(heated(200.0), place, 0.0),
            macro=guard.envelope.Envelope(9e3, 1.0, 9.0),
            micro=guard.envelope.Envelope(place + 9e-3, 0.1e-3, 9.0),
        )
        if seen:
            watch = watch._replace(seen=watch.seen._replace(encoder=1e6, time=-DT))
        watch, _ = guard.step(P, watch, sample(0), far, SAFE, DT)
        assert watch.fault == (codes.ENCODER_JUMP, codes.MACRO_LOST)[k]
    illegal, _ = guard.step(P, guard.fresh(), sample(0), far, SAFE._replace(ctrl=9.0), DT)
    assert illegal.fault == codes.ILLEGAL
    only_micro = far._replace(macro_active=0.0)
    hot = guard.fresh()._replace(
        heat=Heat(heated(200.0), place, 0.0),
        micro=guard.envelope.Envelope(place + 9e-3, 0.1e-3, 9.0),
    )
    assert guard.step(P, hot, sample(0), only_micro, SAFE, DT)[0].fault == codes.MICRO_LOST
    assert guard.step(P, hot, sample(0), QUIET, SAFE, DT)[0].fault == codes.TOO_HOT


def test_nothing_is_told_while_all_is_well() -> None:
    assert guard.fresh()[:4] == (codes.OK, 0.0, 0.0, 0.0)
    assert guard.fresh().heat.idle == 0.0 and math.isnan(guard.fresh().heat.anchor)
    assert run(FINE, 5)[0][:4] == (codes.OK, 0.0, 0.0, 0.0)
    assert guard._heat_fault(LIMITS, Heat(heated(0.0), 0.0, 0.0)) == (codes.OK, 0.0, 0.0)


@pytest.mark.parametrize("push", [3.9, -3.9])
def test_a_carriage_that_is_stuck_is_told_with_the_push_whichever_way(push: float) -> None:
    watch, given, tripped = run(SAFE._replace(motor=push), 300)
    assert (watch.fault, watch.value, given) == (codes.STUCK, 3.9, SAFE)
    assert tripped in (250, 251)
