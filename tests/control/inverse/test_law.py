"""The law `inverse` on a wire that is its own model, and on wires that are not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control import contract
from macromicro.control.inverse import law
from macromicro.control.inverse.law import INVERSE
from macromicro.control.inverse.learned import BASE, HEAT, LAG, LOSS
from macromicro.control.inverse.model import prepare
from macromicro.control.stage_law import Sample, Target
from macromicro.hysteresis import advance
from macromicro.kernel import compiled
from macromicro.models import stressed

from .wires import DT, GAINS, SURE, Wire

TOP = GAINS.volts[-1]


def arrived(places: np.ndarray, goal: float, near: float) -> float:
    """Seconds until the last place that is away."""
    away = np.flatnonzero(np.abs(places - goal) > near)
    return (int(away[-1]) + 1) * DT if len(away) else 0.0


@pytest.mark.slow
def test_it_keeps_the_contract_of_laws() -> None:
    assert contract.broken(INVERSE) == []


def test_it_is_as_quick_as_full_heat_and_then_holds() -> None:
    w, full = Wire(), Wire()
    places = w.go(2.0, 1.5)
    while full.s.x < 1.99:
        full._after(TOP)
    assert arrived(places, 2.0, 0.01) <= len(full.places) * DT + 0.01
    assert np.abs(places[-500:] - 2.0).max() < 5e-4
    assert places.max() < 2.002


def test_it_extends_as_quickly_as_no_heat_does() -> None:
    w = Wire()
    w.go(3.0, 1.0)
    places, sent = w.go(1.0, 1.5), w.sent[-1500:]
    quiet = next(k for k, v in enumerate(sent) if v > 0.0)
    assert np.all(np.array(sent[:quiet]) == 0.0)
    # Heat comes back just before the place is reached, and in time.
    assert places[quiet] < 1.025 and places.min() > 0.998
    assert np.abs(places[-300:] - 1.0).max() < 5e-4


def test_a_held_place_is_left_alone() -> None:
    """No limit cycle across the reversals' dead zone."""
    w = Wire()
    w.go(2.0, 1.0)
    places = w.go(1.95, 2.0)
    assert np.ptp(places[-1000:]) < 5e-4


def test_what_the_sensor_shows_beyond_the_model_is_taken_off() -> None:
    w = Wire(SURE)
    w.beyond = 0.05
    places = w.go(2.0, 1.5)
    assert w.memory.offset == pytest.approx(0.05, abs=5e-4)
    assert places[-1] == pytest.approx(1.95, abs=5e-4)


def test_an_offset_that_grows_is_followed_without_a_lag() -> None:
    w = Wire(SURE)
    w.go(2.0, 1.0)
    w.rate = 0.1  # a filter of 25 ms alone would be 2.5 um behind
    w.go(2.0, 0.5)
    assert w.memory.drift == pytest.approx(0.1, rel=0.02)
    assert w.seen + w.beyond == pytest.approx(2.0, abs=5e-4)


def test_heat_that_nobody_told_of_does_not_move_a_held_place() -> None:
    for warmer in (4.0, -4.0):
        w = Wire()
        w.go(2.0, 1.0)
        w.warmer = warmer
        assert np.abs(w.go(2.0, 4.0) - 2.0).max() < 3e-3


def test_fully_extended_needs_no_heat() -> None:
    w = Wire()
    assert np.all(w.go(0.0, 0.2) == 0.0) and set(w.sent) == {0.0}
    w.go(1.0, 1.0)
    w.go(0.0, 1.0)
    assert w.sent[-1] == 0.0


def test_a_missing_reading_leaves_the_offset() -> None:
    w = Wire()
    w.go(2.0, 1.0)
    w.beyond = 0.5
    before = w.memory.offset
    for _ in range(20):
        w.period(2.0, missing=True)
    assert w.memory.offset == before
    w.period(2.0)
    assert w.memory.offset > before


def test_while_it_rests_the_model_cools_as_the_wire_does() -> None:
    w = Wire()
    w.go(2.0, 1.0)
    offset = w.memory.offset
    for _ in range(1000):
        w.pause()
    assert w.memory.model.x == pytest.approx(w.s.x, abs=1e-6)
    assert w.memory.shown == pytest.approx(w.seen, abs=1e-6)
    assert w.memory.offset == offset and w.memory.drift == 0.0 and math.isnan(w.memory.goal)
    # The next turn begins a step.
    w.period(2.0)
    assert w.memory.since == 0.0


def test_on_a_way_heat_leads_by_the_speed() -> None:
    """Nothing limits the rate of heat there, and the place follows without a lag."""
    w, off = Wire(), []
    w.go(1.5, 1.0)
    for k in range(2000):
        t = k * DT
        goal, speed = 1.5 + 0.3 * (1.0 - math.cos(2.0 * t)), 0.6 * math.sin(2.0 * t)
        w.period(goal, speed)
        off.append(w.places[-1] - goal)
    assert float(np.sqrt(np.mean(np.square(off[200:])))) < 1.5e-3


SWING = 0.4 * math.pi  # rad/s of a slow sine


def waved(foreseen: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A sine under a noisy sensor: its phase, what the wire is off by (mm), and what was sent."""
    w, noise = Wire(SURE), np.random.default_rng(3).normal(0.0, 1e-3, 5000)
    w.go(1.5, 1.0)
    phase = SWING * DT * np.arange(5000)
    goal = 1.5 + 0.5 * (1.0 - np.cos(phase))
    for k, at in enumerate(phase):
        w.beyond = noise[k]
        until = (math.pi - at % math.pi) / SWING
        speed = 0.5 * SWING * math.sin(at)
        w.period(goal[k], speed, turn=until if foreseen else math.inf)
    return phase, np.array(w.places[-5000:]) - goal, np.array(w.sent[-5000:])


def test_half_of_the_way_across_the_dead_zone_lies_before_the_turn() -> None:
    phase, off, sent = waved(True)
    late = waved(False)[2]
    near = np.abs(phase - math.pi) < 0.3
    cold, tardy = (phase[near & (volts == 0.0)] - math.pi for volts in (sent, late))
    assert cold[0] < 0.0 < tardy[0] and cold[-1] < tardy[-1]
    assert np.abs(off[near]).max() < 1e-3
    # Where it turns upwards, full heat does it, all of it before the turn but for the delays.
    low = np.abs(phase - 2.0 * math.pi) < 0.1
    full = phase[low & (sent >= TOP - 0.01)] - 2.0 * math.pi
    assert full[0] < 0.0 and full[-1] < SWING * 0.01 and np.abs(off[low]).max() < 1e-3
    assert late[low].max() < TOP - 0.01


def test_a_trajectory_is_not_followed_back_for_a_few_micrometres() -> None:
    """Nor for what noise makes of them; what is far off is."""
    w = Wire(SURE)
    w.go(2.0, 1.0)
    place = w.s.x
    for _ in range(200):
        w.period(place - 0.005, 0.05)
    assert w.s.x == pytest.approx(place, abs=1e-4)
    for _ in range(300):
        w.period(place - 0.05, 0.05)
    assert place - 0.05 - 1e-3 < w.s.x < place - 0.05 + law.BACK


def test_the_filter_is_quick_far_away_and_after_a_step_and_calm_later() -> None:
    w = Wire()
    w.go(2.0, 1.0)
    assert w.memory.since > 0.3
    kept = w.memory
    w.beyond += 1e-3
    w.period(2.0)
    calm = w.memory.offset - kept.offset
    w.go(2.0, 1.0)
    w.period(2.1)
    assert w.memory.since == 0.0
    kept = w.memory
    w.beyond += 1e-3
    w.period(2.1)
    quick = w.memory.offset - kept.offset
    assert quick > 2.0 * calm > 0.0


def test_rounding_of_the_converter_is_owed_and_made_good() -> None:
    w = Wire()
    m, loss = w.p.model, 0.0
    w.go(2.0, 1.5)
    for _ in range(500):
        w.period(2.0)
        loss += (w.memory.model.wire - w.memory.model.plates) / m.ladder.r1 / 500.0
    sent = np.array(w.sent[-500:])
    steps = sent / w.p.step
    assert np.allclose(steps, np.round(steps), atol=1e-9) and len(set(sent)) > 1
    heats = [stressed.static_heat(m, v) for v in sent]
    assert np.mean(heats) == pytest.approx(loss, abs=0.3)


def test_wanted_is_the_content_at_which_the_model_has_the_place() -> None:
    p = prepare(GAINS._replace(low=0.2e-3)).model
    s = stressed.cold(p)
    for place in (0.5, 1.0, 2.5):
        content = law.wanted(p, s, place)
        u = law.invert(p.hysteresis.table, s.memory, (place - p.hysteresis.low) / p.hysteresis.span)
        memory, share = advance(p.hysteresis.table, s.memory, u)
        assert p.hysteresis.low + p.hysteresis.span * share == pytest.approx(place, abs=1e-9)
        assert content == pytest.approx(
            u + p.shift + p.stiffening * p.hysteresis.span * share - p.ambient + p.latent * share
        )
        s = s._replace(memory=memory)


def test_compiled_and_interpreted_agree() -> None:
    p = prepare(GAINS)
    slow = quick = None
    for step, rest in ((law.step, law.rest), (compiled(law.step), compiled(law.rest))):
        memory, sent = law.start(p, Sample(0.0, 0.0)), []
        for k in range(400):
            sample = Sample(k * DT, 1e-3 * memory.model.x + 1e-6 * math.sin(k))
            if 200 <= k < 230:
                memory = rest(p, memory, sample, DT)
                continue
            goal = 2e-3 if k < 300 else 1e-3
            memory, volts = step(p, memory, Target(goal, 0.0, 0.0), sample, DT)
            sent.append(volts)
        if slow is None:
            slow = (sent, law.tell(memory))
        else:
            quick = (sent, law.tell(memory))
    assert slow is not None and quick is not None
    assert quick[0] == pytest.approx(slow[0], rel=1e-12)
    assert tuple(quick[1]) == pytest.approx(tuple(slow[1]), rel=1e-9)


def test_told_are_place_offset_wires_plates_and_what_was_learned() -> None:
    w = Wire()
    w.go(1.0, 0.5)
    told = law.tell(w.memory)
    m = w.memory
    known = (m.learned.values[k] for k in (BASE, HEAT, LOSS, LAG))
    assert told == (m.model.x, m.offset, m.model.wire, m.model.plates, *known)
