"""Macro, then micro: Section 6.1, Figure 6.1."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import pytest

from macromicro.control import macro, settings, supervisor
from macromicro.control.settings import Control
from macromicro.control.supervisor import (
    DONE,
    MACRO,
    MICRO,
    SETTLING,
    WAITING,
    Plan,
    Progress,
    Sequence,
    Supervisor,
)
from macromicro.types import Command, Outputs, Sample

NAN = math.nan
DT = 1e-3
Move = tuple[float, int, float, float]


def plan(*moves: Move, end: float = NAN) -> Plan:
    """A plan of (start, stage, target, hold)."""
    start, stage, target, hold = zip(*moves, strict=True)
    return Plan(
        np.array(start, dtype=float),
        np.array(stage, dtype=np.int64),
        np.array(target, dtype=float),
        np.array(hold, dtype=float),
        end,
    )


def made(**sequence: float) -> Supervisor:
    """The default supervisor with another sequence."""
    return settings.prepare(Control(sequence=Sequence()._replace(**sequence)))


class Tick(NamedTuple):
    """One control period."""

    t: float
    phase: int
    move: int
    command: Command
    out: Outputs
    integral: float


def walk(
    p: Supervisor, what: Plan, seconds: float, place: Callable[[float], float], hall: float = 0.1
) -> list[Tick]:
    """Step the supervisor with the encoder at `place(t)` [counts] and a constant Hall reading."""
    s, ticks = supervisor.begin(place(0.0)), []
    for k in range(round(seconds / DT)):
        t = k * DT
        sample = Sample(t, place(t), hall, 0.0, 1.0, 0.0)
        s, command, out = supervisor.step(p, what, s, sample, DT)
        ticks.append(Tick(t, s.phase, s.move, command, out, s.integral))
        if s.phase == DONE:
            break
    return ticks


def entries(ticks: list[Tick]) -> list[tuple[float, int, int]]:
    """When (phase, move) changed: (t, phase, move)."""
    found = [(ticks[0].t, ticks[0].phase, ticks[0].move)]
    for tick in ticks:
        if (tick.phase, tick.move) != found[-1][1:]:
            found.append((tick.t, tick.phase, tick.move))
    return found


def arrives(at: float, target: float) -> Callable[[float], float]:
    """An encoder that jumps from 0 to `target` counts at `at` seconds."""
    return lambda t: target if t >= at - 1e-9 else 0.0


def test_macro_arrival_two_seconds_laser_reset_then_micro() -> None:
    """Figure 6.1: the whole sequence with its times; arrival takes 0.2 s within 2 counts."""
    what = plan((NAN, 0, 100.0, 0.0), (NAN, 1, 1.5e-3, 2.0))
    ticks = walk(made(), what, 10.0, arrives(0.5, 99.0))
    seen = entries(ticks)
    assert [phase for _, phase, _ in seen] == [MACRO, SETTLING, MICRO, DONE]
    assert [t for t, _, _ in seen] == pytest.approx([0.0, 0.7, 2.7, 4.7], abs=1.1e-3)
    resets = [tick.t for tick in ticks if tick.out.laser_reset > 0.5]
    assert resets == pytest.approx([2.7], abs=1.1e-3)
    active = [tick.t for tick in ticks if tick.command.micro_active > 0.5]
    assert min(active) >= resets[0]


def test_a_disabled_stage_gets_zero_volts() -> None:
    """Section 6.1: the micro-stage gets 0 V, not its limit of 1.3 V, until it is its turn."""
    what = plan((NAN, 0, 100.0, 0.0), (NAN, 1, 1.5e-3, 1.0), (NAN, 0, 50.0, 0.0))
    for tick in walk(made(), what, 8.0, arrives(0.5, 100.0)):
        if tick.phase == MICRO:
            assert 1.3 <= tick.out.ctrl <= 1.9
        else:
            assert tick.out.ctrl == 0.0
            assert tick.command.micro_active == 0.0
            assert tick.integral == 0.0 or tick.phase == DONE
        if tick.phase != MACRO:
            assert tick.out.motor == 0.0
            assert tick.command.macro_active == 0.0


def test_macro_stays_under_control_when_it_is_not_parked() -> None:
    """`park` 0: an error while the micro-stage works is answered."""
    what = plan((NAN, 0, 100.0, 0.0), (NAN, 1, 1.5e-3, 1.0))
    ticks = walk(made(park=0), what, 8.0, arrives(0.5, 99.0))
    late = [tick for tick in ticks if tick.phase == MICRO]
    assert late and all(tick.out.motor > 3.0 for tick in late)
    assert all(tick.command.macro_active == 1.0 for tick in late)


def test_dwell_starts_again_when_the_carriage_leaves_the_tolerance() -> None:
    """Section 4.3: passing through the set point is no arrival."""
    what = plan((NAN, 0, 100.0, 0.0))

    def place(t: float) -> float:
        return 100.0 if 0.3 <= t < 0.4 or t >= 0.8 else 110.0

    seen = entries(walk(made(), what, 4.0, place))
    assert seen[1][1] == SETTLING
    assert seen[1][0] == pytest.approx(1.0, abs=1.1e-3)


def test_a_missing_encoder_reading_is_no_arrival() -> None:
    """NaN is within no tolerance."""
    what = plan((NAN, 0, 100.0, 0.0))
    ticks = walk(made(), what, 2.0, lambda t: NAN if t >= 0.1 else 0.0)
    assert {tick.phase for tick in ticks} == {MACRO}


def test_patience_ends_a_move_that_never_arrives() -> None:
    """The programme goes on; the move is reported as not arrived."""
    what = plan((NAN, 0, 100.0, 0.0), (NAN, 1, 1e-3, 0.5))
    ticks = walk(made(patience=3.0), what, 10.0, lambda _: 0.0)
    seen = entries(ticks)
    assert [phase for _, phase, _ in seen] == [MACRO, SETTLING, MICRO, DONE]
    assert seen[1][0] == pytest.approx(3.0, abs=1.1e-3)


def test_micro_moves_follow_each_other_without_a_reset() -> None:
    """Figure 6.2: the laser is zeroed once, then 1.5 and 3.0 mm two seconds apart."""
    what = plan((NAN, 0, 0.0, 0.0), (NAN, 1, 1.5e-3, 2.0), (NAN, 1, 3e-3, 2.0))
    ticks = walk(made(), what, 10.0, lambda _: 0.0)
    assert sum(tick.out.laser_reset > 0.5 for tick in ticks) == 1
    starts = [t for t, phase, _ in entries(ticks) if phase == MICRO]
    assert np.diff(starts) == pytest.approx([2.0], abs=1.1e-3)
    references = [tick.command.micro_reference for tick in ticks if tick.phase == MICRO]
    assert sorted(set(references)) == [1.5e-3, 3e-3]


def test_next_macro_move_disables_the_micro_stage_and_forgets_its_integral() -> None:
    """Figure 6.1."""
    what = plan((NAN, 1, 2e-3, 1.0), (NAN, 0, 50.0, 0.0), (NAN, 1, 2e-3, 1.0))
    ticks = walk(made(), what, 8.0, lambda t: 50.0)
    middle = [tick for tick in ticks if tick.move == 1]
    assert all(tick.out.ctrl == 0.0 and tick.integral == 0.0 for tick in middle)
    assert sum(tick.out.laser_reset > 0.5 for tick in ticks) == 2
    first = next(tick for tick in ticks if tick.move == 2 and tick.phase == MICRO)
    fresh = next(tick for tick in ticks if tick.move == 0 and tick.phase == MICRO)
    assert first.integral == pytest.approx(fresh.integral)


def test_hold_of_a_macro_move_is_added_to_the_wait() -> None:
    what = plan((NAN, 0, 0.0, 1.5))
    ticks = walk(made(), what, 10.0, lambda _: 0.0)
    assert ticks[-1].phase == DONE
    assert ticks[-1].t == pytest.approx(0.2 + 2.0 + 1.5, abs=2e-3)


def test_scheduled_moves_begin_at_their_times() -> None:
    """A programme in time: macro at 0.1 s, micro at 4 s, next macro at 5 s, end at 8 s."""
    what = plan((0.1, 0, 40.0, 0.0), (4.0, 1, 1e-3, 0.0), (5.0, 0, 0.0, 0.0), end=8.0)
    ticks = walk(made(), what, 20.0, lambda t: 40.0 if t < 5.0 else 0.0)
    seen = entries(ticks)
    phases = [phase for _, phase, _ in seen]
    assert phases == [WAITING, MACRO, SETTLING, MICRO, MACRO, SETTLING, DONE]
    starts = {move: t for t, phase, move in seen if phase in (MACRO, MICRO)}
    assert starts == pytest.approx({0: 0.1, 1: 4.0, 2: 5.0}, abs=1.1e-3)
    assert ticks[-1].t == pytest.approx(8.0, abs=1.1e-3)


def test_a_scheduled_macro_move_cuts_in() -> None:
    """It waits neither for an arrival nor for the micro-stage."""
    what = plan((0.0, 0, 100.0, 0.0), (0.5, 0, 0.0, 0.0), end=1.0)
    ticks = walk(made(), what, 5.0, lambda _: 50.0)
    assert {tick.command.macro_reference for tick in ticks if tick.t < 0.499} == {100.0}
    assert {tick.command.macro_reference for tick in ticks if tick.t > 0.501} == {0.0}
    assert ticks[-1].phase == DONE


def test_a_scheduled_micro_move_waits_until_the_carriage_has_settled() -> None:
    """Section 6.1: due at 0.5 s, but arrival and two seconds come first."""
    what = plan((0.0, 0, 100.0, 0.0), (0.5, 1, 1e-3, 0.0), end=6.0)
    seen = entries(walk(made(), what, 10.0, arrives(1.0, 100.0)))
    micro = [t for t, phase, _ in seen if phase == MICRO]
    assert micro == pytest.approx([1.0 + 0.2 + 2.0], abs=2.1e-3)


def test_an_overdue_micro_move_gives_way_to_its_successor() -> None:
    """Scheduled micro moves that the wait has overtaken are passed over: the latest counts."""
    what = plan((0.0, 0, 100.0, 0.0), (0.5, 1, 1e-3, 0.0), (1.5, 1, 2e-3, 0.0), end=6.0)
    ticks = walk(made(), what, 10.0, arrives(1.0, 100.0))
    assert {tick.command.micro_reference for tick in ticks if tick.phase == MICRO} == {2e-3}


def test_nothing_moves_before_the_first_scheduled_time() -> None:
    what = plan((1.0, 0, 100.0, 0.0), end=2.0)
    for tick in walk(made(), what, 5.0, lambda _: 7.0):
        if tick.t < 0.999:
            assert tick.phase == WAITING
            assert tick.out == Outputs(0.0, 0.0, 0.0, 0.0)
            assert tick.command.macro_reference == 7.0


def test_errors_are_counts_for_macro_and_metres_for_micro() -> None:
    """Section 6.1: as in the thesis' gains."""
    p = made()
    what = plan((NAN, 1, 0.25e-3, 1.0))
    (tick,) = walk(p, what, DT, lambda _: 0.0, hall=2.5)
    assert tick.command.micro_reference == 0.25e-3
    assert tick.command.micro_position == pytest.approx(1.99e-3, abs=0.02e-3)
    wanted = 3e3 * (0.25e-3 - tick.command.micro_position)
    assert tick.out.ctrl == min(max(wanted, 1.3), 1.9)
    (tick,) = walk(p, plan((NAN, 0, 30.0, 0.0)), DT, lambda _: 0.0)
    assert tick.out.motor == pytest.approx(3.0 + 0.0124593 * 30.0)


def test_the_fan_runs_all_the_time_or_never() -> None:
    """Section 6.3.1."""
    what = plan((NAN, 0, 0.0, 0.0))
    for fan in (False, True):
        p = settings.prepare(Control(), fan=fan)
        assert {tick.out.fan for tick in walk(p, what, 3.0, lambda _: 0.0)} == {float(fan)}


def test_a_missing_reading_gives_no_effort_and_is_forgotten() -> None:
    """One NaN from a sensor must not stay in an integral: the guard allows 5 ms of them."""
    spec = Control(macro_law="pid")
    control = settings.prepare(spec)
    moves = Plan(
        np.array([math.nan]), np.array([0], dtype=np.int64), np.array([500.0]),
        np.array([1.0]), math.nan,
    )  # fmt: skip
    state = supervisor.begin(0.0)
    efforts = []
    for k in range(6):
        encoder = math.nan if k == 2 else 0.0
        sample = Sample(k * 1e-3, encoder, 0.05, 0.0, 1.0, 0.0)
        state, _, out = supervisor.step(control, moves, state, sample, 1e-3)
        efforts.append(out.motor)
    assert efforts[2] == 0.0
    assert all(math.isfinite(v) and v > 0.0 for v in efforts[3:])


@pytest.mark.parametrize("moving", [True, False])
def test_the_law_is_given_the_correction_and_the_command_the_target(moving: bool) -> None:
    what = plan((0.0, 1, 1e-3, 9.0), end=9.0)
    still = np.zeros(1) if moving else np.empty(0)
    given: list[tuple[float, float]] = []
    for target, extra in ((1e-3, 2e-4), (1.2e-3, 0.0)):
        learned = what._replace(
            target=np.array([target]), velocity=still, acceleration=still,
            correction=np.array([extra]),
        )  # fmt: skip
        s = supervisor.begin(0.0)
        for k in range(3):
            sample = Sample(k * DT, 0.0, 2.0, NAN, 0.0, 0.0)
            s, command, out = supervisor.step(made(), learned, s, sample, DT)
        assert command.micro_reference == target
        given.append((out.ctrl, s.integral))
    assert given[0] == pytest.approx(given[1])


LEFT = tuple(type(memory)(*[3.0] * len(memory)) for memory in macro.rest(0.0))


def in_phase(phase: int, park: int, move: int = 0) -> tuple[float, Progress]:
    """Motor [V] and state after one period in this phase, 50 counts from the macro target."""
    base = made()
    p = base._replace(sequence=base.sequence._replace(park=park))
    s = supervisor.begin(0.0)._replace(
        phase=phase, move=move, macro_reference=100.0, macro=LEFT, entered=1.0
    )
    what = plan((99.0 if move < 0 else NAN, 1, 1e-3, 90.0), (NAN, 1, 1.5e-3, 90.0))
    s, _, out = supervisor.step(p, what, s, Sample(1.0, 50.0, 2.0, NAN, 0.0, 0.0), 1e-3)
    return out.motor, s


@pytest.mark.parametrize("phase", [MACRO, SETTLING, MICRO, DONE])
@pytest.mark.parametrize("park", [0, 1])
def test_the_motor_is_on_in_its_turn_and_behind_it_only_where_it_is_not_parked(
    phase: int, park: int
) -> None:
    motor, s = in_phase(phase, park)
    on = phase == MACRO or (park == 0 and phase != DONE)
    assert (motor != 0.0) == on
    assert (s.macro != LEFT) == on


def test_before_the_first_move_nothing_is_held() -> None:
    for park in (0, 1):
        assert in_phase(WAITING, park, move=-1)[0] == 0.0


@pytest.mark.parametrize("park", [0, 1])
@pytest.mark.parametrize("phase", [MICRO, SETTLING])
def test_a_macro_move_behind_a_parked_carriage_begins_without_memory(phase: int, park: int) -> None:
    base = made()
    p = base._replace(sequence=base.sequence._replace(park=park))
    s = supervisor.begin(0.0)._replace(
        phase=phase, move=0, entered=1.0, macro=LEFT, zeroed=1, integral=1.4
    )
    what = plan((NAN, 1, 1e-3, 0.5), (NAN, 0, 90.0, 0.0))
    # The law itself is left out: a missing reading gives no effort and leaves the memory.
    s, _, out = supervisor.step(p, what, s, Sample(9.0, NAN, 2.0, NAN, 0.0, 0.0), 1e-3)
    assert (s.phase, s.move, s.macro_reference, s.integral) == (MACRO, 1, 90.0, 0.0)
    assert s.macro == (macro.rest(0.0) if park == 1 else LEFT)
    assert out.motor == 0.0


def test_set_points_of_a_profile_follow_by_the_clock_and_its_end_waits_for_the_arrival() -> None:
    """-inf: when the hold of the one before is over; what comes behind waits as for a move."""
    way = [(NAN, 0, 10.0, 0.1), (-math.inf, 0, 20.0, 0.1), (-math.inf, 0, 30.0, 0.3)]
    what = plan(*way, (NAN, 1, 1e-3, 0.1), (-math.inf, 1, 2e-3, 0.1), (-math.inf, 1, 3e-3, 0.2))
    seen = entries(walk(made(), what, 20.0, arrives(1.0, 30.0)))
    assert [(phase, move) for _, phase, move in seen] == [
        (MACRO, 0), (MACRO, 1), (MACRO, 2), (SETTLING, 2), (MICRO, 3), (MICRO, 4), (MICRO, 5),
        (DONE, 5),
    ]  # fmt: skip
    times = [0.0, 0.1, 0.2, 1.2, 3.5, 3.6, 3.7, 3.9]
    assert [t for t, _, _ in seen] == pytest.approx(times, abs=2.1e-3)


def test_a_micro_profile_is_not_passed_over_while_the_carriage_settles() -> None:
    what = plan((NAN, 0, 30.0, 0.0), (NAN, 1, 1e-3, 0.1), (-math.inf, 1, 2e-3, 0.1))
    seen = entries(walk(made(), what, 20.0, arrives(1.0, 30.0)))
    assert [move for _, phase, move in seen if phase == MICRO] == [1, 2]


def test_both_stages_at_once_where_the_sequence_says_so() -> None:
    """The micro-stage goes to its next place with the macro move, and the laser is reset there."""
    p = made(overlap=1, wait=0.1)
    what = plan((NAN, 0, 100.0, 0.0), (NAN, 1, 1.5e-3, 0.3), (NAN, 0, 50.0, 0.0))
    ticks = walk(p, what, 1.5, arrives(0.2, 100.0))
    first = ticks[0]
    assert first.phase == MACRO and first.command.micro_active == 1.0
    assert first.command.micro_reference == 1.5e-3 and first.out.ctrl > 1.3
    before = [tick for tick in ticks if tick.move == 0]
    assert {tick.command.micro_reference for tick in before} == {1.5e-3}
    assert {tick.phase for tick in before} == {MACRO, SETTLING}
    fine = [tick for tick in ticks if tick.move == 1]
    assert [tick.out.laser_reset for tick in fine[:3]] == [1.0, 0.0, 0.0]
    # What was integrated on the way is kept, and no next fine move: it stays where it is.
    assert fine[0].integral < before[-1].integral < before[0].integral < 0.0  # wound by Kaw
    after = [tick for tick in ticks if tick.move == 2]
    assert after and {tick.command.micro_reference for tick in after} == {1.5e-3}
    assert all(tick.command.micro_active == 1.0 for tick in after)


def test_one_after_the_other_the_micro_stage_is_extended_meanwhile() -> None:
    what = plan((NAN, 0, 100.0, 0.0), (NAN, 1, 1.5e-3, 0.3), (NAN, 0, 50.0, 0.0))
    ticks = walk(made(wait=0.1), what, 1.5, arrives(0.2, 100.0))
    for tick in ticks:
        if tick.phase in (MACRO, SETTLING):
            assert tick.command.micro_reference == 0.0 and tick.command.micro_active == 0.0
            assert tick.out.ctrl == 0.0


def test_before_the_first_move_neither_stage_is_driven() -> None:
    p = made(overlap=1)
    what = plan((1.0, 0, 100.0, 0.0), (NAN, 1, 1.5e-3, 0.3), end=2.0)
    (tick,) = walk(p, what, DT, lambda _: 0.0)
    assert tick.phase == WAITING and tick.command.micro_active == 0.0 and tick.out.ctrl == 0.0
