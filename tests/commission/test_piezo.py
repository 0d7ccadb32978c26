"""A piezo stage commissioned as a whole; its fits on records of which all is known."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tests.commission.stages import stage

from macromicro.commission import (
    _piezo_fit,
    _store,
    piezo,
    piezo_drives,
    report,
)
from macromicro.commission._piezo_fit import Loops
from macromicro.commission.courses import Corner, course, decaying
from macromicro.commission.procedure import Options, Work
from macromicro.commission.running import Commissioned, Place, commission
from macromicro.commission.stand import CommissionError, Record
from macromicro.errors import InputError
from macromicro.hysteresis import prandtl
from macromicro.machines import machine
from macromicro.plant import creep

Done = tuple[Commissioned, Place, Options, Path, list[str]]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    out = tmp_path_factory.mktemp("piezo")
    place, options, _ = stage("piezo-800um.toml", turned=True)
    said: list[str] = []
    found = commission(
        place, options, out, ask=lambda title, intent: said.append(f"{title}: {intent}")
    )
    report.write(out, found, place, "2026-01-01 12:00:00")
    return found, place, options, out, said


@pytest.mark.slow
def test_it_finds_the_stage_and_verifies_it(done: Done) -> None:
    found, place, _, _, _ = done
    tree = stage("piezo-800um.toml")[2]
    estimates = place.kind.estimates(found.model)
    true = {
        "stroke": tree.hidden.stronger * tree.stack.stroke,
        "hysteresis": tree.stack.hysteresis,
        "creep": tree.creep.share,
        "damping": tree.hidden.damping,
        "slew": tree.amplifier.current / tree.amplifier.capacitance / tree.amplifier.gain,
    }
    for name, value in true.items():
        assert abs(estimates[name].value - value) <= estimates[name].half, name
        assert estimates[name].half < 0.15 * value, name
    assert found.verified.met
    assert found.work[piezo.GAIN].sign == -1.0


@pytest.mark.slow
def test_its_loop_is_robust_on_what_it_may_be_as_well(done: Done) -> None:
    found = done[0]
    assert found.margins.doubts == ()
    name, value, least, unit = found.margins.rows[1]
    assert (name, unit) == ("phase margin", "deg")
    assert 30.0 < 0.9 * float(value) < float(least.removeprefix(">= ")) <= float(value) < 90.0


@pytest.mark.slow
def test_every_step_says_how_far_and_how_hard(done: Done) -> None:
    said = done[4]
    assert len(said) == 5
    assert "0.6 V" in said[0] and "5 %" in said[0]
    assert "to 12 V, to -2 V" in said[1] and "0.4" in said[1]
    assert "between -2 and 12 V" in said[2]
    assert "0.14 to 4.2 V" in said[3]
    assert "7 moves" in said[4]


@pytest.mark.slow
def test_the_file_runs_and_the_page_shows_it(done: Done) -> None:
    found, place, _, out, _ = done
    kind, tree = machine.load(out / report.MACHINE)
    assert kind.name == "piezo" and tree == found.settings
    assert tree.controller.loop_weights == pytest.approx(found.model.loops.weights, rel=1e-6)
    assert tree.travel.high == pytest.approx(0.95 * found.work[piezo.REACH].high)
    said = " ".join((out / report.MACHINE).read_text().replace("#", " ").split())
    assert "What is not below was not measured and is that of the default stage, PI's P-621" in said
    page = (out / report.PAGE).read_text()
    assert page.count("data:image/png;base64,") == len(place.kind.figures) + 1
    assert "reverse the sensor" in page
    assert sorted(p.name for p in out.iterdir()) == sorted(
        n for n in report.names(place.kind) if not n.endswith((".svg", ".pdf"))
    )


@pytest.mark.slow
def test_what_was_kept_is_enough_for_the_model(done: Done) -> None:
    found, place, options, out, _ = done
    kept = _store.read_steps(out, place.kind, place.asked(options))
    again = piezo.fit(Work(found.work.stand, options, kept))
    assert again == found.model
    with pytest.raises(InputError, match="kind"):
        _store.read_steps(out, place.kind, {**place.asked(options), "kind": "wire"})


def swings(p: prandtl.Prandtl, share: float, dt: float) -> list[Record]:
    """Slow swings of an operator with creep, without noise."""
    turns = ([-2.0, 6.0, -2.0, *decaying(2.0, 3.5, 8)], [-2.0, 6.0, 3.0, 6.0, 0.0, 6.0, -2.0, 6.0])
    made = []
    for corners in turns:
        u = course([Corner(c, 0.05 if k else 2.0, 4.0) for k, c in enumerate(corners)], dt)
        free = prandtl.run(p, u)
        table = creep.prepare(creep.Creep(share=share))
        lags = creep.fresh(table)
        x = np.array([creep.advance(table, lags, float(f), dt) for f in free])
        made.append(Record(np.arange(len(u)) * dt, u, x))
    return made


def test_loops_and_creep_are_found_together() -> None:
    r = 0.25 * np.arange(16)
    w = 1e-6 * np.r_[5.0, 0.8 * np.exp(-r[1:])]
    dt = 4e-3
    found = _piezo_fit.fitted_loops(swings(prandtl.operator(r, w), 0.02, dt), dt)
    assert found.creep == pytest.approx(0.02, rel=0.02)
    assert found.weights == pytest.approx(w, abs=2e-8)
    left = 4.0 - r
    assert found.stroke == pytest.approx(float(2.0 * w @ left), rel=1e-3)
    width = float(2.0 * w @ np.minimum(r, left))
    assert found.width == pytest.approx(width / found.stroke, rel=1e-2)
    none = _piezo_fit.fitted_loops(swings(prandtl.operator(r, w), 0.0, dt), dt)
    assert none.creep < 1e-4
    u, x, left_over = _piezo_fit.predict(found, swings(prandtl.operator(r, w), 0.02, dt)[0], dt)
    assert len(u) == len(x) and np.abs(left_over).max() < 2e-3 * found.stroke


def test_first_order_curves_open_as_the_plays_do_where_the_loop_is_one_everywhere() -> None:
    r = 0.25 * np.arange(16)
    w = 1e-6 * np.r_[5.0, 0.8 * np.exp(-r[1:])]
    dt = 4e-3
    made = swings(prandtl.operator(r, w), 0.0, dt)
    found = _piezo_fit.fitted_loops(made, dt)
    every = _piezo_fit.curves(made[1], found, dt)
    assert [c.turn for c in every] == pytest.approx([3.0, 0.0, -2.0])
    for one in every:
        # A play follows its slot's edges: down along u + r from 6 - r, up along u - r.
        u = np.linspace(one.turn, 6.0, 99)[:, None]
        down, there = np.minimum(u + r, 6.0 - r), np.minimum(one.turn + r, 6.0 - r)
        opened = float(np.max((down - np.maximum(u - r, there)) @ w))
        assert one.opening == pytest.approx(opened, rel=0.02)
        assert one.modelled == pytest.approx(one.opening, rel=1e-3)
    assert _piezo_fit.apart(every) < 1e-3
    # A loop that is wider at the top.
    bent = [m._replace(x=m.x + 8e3 * m.x * np.abs(m.x)) for m in made]
    found = _piezo_fit.fitted_loops(bent, dt)
    assert _piezo_fit.apart(_piezo_fit.curves(bent[1], found, dt)) > 0.03
    assert _piezo_fit.curves(made[0], found, dt) == [] and _piezo_fit.apart([]) == 0.0


def ringing(omega: float, damping: float, lag: float, slew: float, dt: float) -> list[Record]:
    """Steps of a stage without hysteresis behind a lagged, rate-limited amplifier."""
    made, fine, at = [], 50, 0.0
    random = np.random.Generator(np.random.PCG64(1))
    for size in (0.1, -0.1, 0.2, -0.2, 2.0, -2.0, 3.0, -3.0):
        v, x, speed, h = at, at, 0.0, dt / fine
        rows = [x]
        for _ in range(600):
            for _ in range(fine):
                rate = (at + size - v) / lag
                v += min(max(rate, -slew), slew) * h
                speed += (omega**2 * (v - x) - 2.0 * damping * omega * speed) * h
                x += speed * h
            rows.append(x)
        u = np.full(len(rows), at + size)
        u[0] = at
        noise = 1e-9 * random.standard_normal(len(rows))
        made.append(Record(np.arange(len(rows)) * dt, u, 1e-6 * np.array(rows) + noise))
        at += size
    return made


def test_resonance_lag_and_slew_are_found_from_steps() -> None:
    omega, dt = 2.0 * math.pi * 150.0, 2.5e-4
    steps = ringing(omega, 0.03, 4e-4, 800.0, dt)
    plain = Loops((0.0, 1.0), (1e-6, 0.0), 0.0, 1e-5, 0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
    found = _piezo_fit.fitted_swing(steps, dt, (-5.0, 5.0, 0.0), 1e-9, plain)
    assert found.frequency == pytest.approx(150.0, rel=1e-3)
    assert found.damping == pytest.approx(0.03, rel=0.03)
    assert found.lag == pytest.approx(4e-4, rel=0.05)
    assert found.limited and found.slew == pytest.approx(800.0, rel=0.03)
    free = _piezo_fit.fitted_swing(
        ringing(omega, 0.03, 4e-4, 1e9, dt), dt, (-5.0, 5.0), 1e-9, plain
    )
    assert not free.limited
    assert free.lag == pytest.approx(4e-4, rel=0.05)
    still = [s._replace(x=np.zeros_like(s.x)) for s in steps]
    with pytest.raises(CommissionError, match="no resonance"):
        _piezo_fit.fitted_swing(still, dt, (-5.0, 5.0), 1e-9, plain)


@pytest.mark.parametrize(("speed", "capped"), [(1.0, False), (0.02, True)])
def test_steps_stay_below_the_greatest_speed(speed: float, capped: bool) -> None:
    """A resonance of 100 Hz at 1 um/V passes 0.63 mm/s per volt of a step."""
    dt, omega = 1e-4, 2.0 * math.pi * 100.0
    sizes = [0.7, 0.7, 1.4, 2.8, 5.6, 11.2, 21.0]
    law = piezo_drives.Steps(28.0, sizes, speed, 35.0, dt)
    x, v, fastest, efforts = 0.0, 0.0, 0.0, []
    while (given := law(len(efforts) * dt, x, v)) is not None:
        efforts.append(given)
        v += (omega**2 * (1e-6 * given - x) - 2.0 * 0.02 * omega * v) * dt
        x += v * dt
        fastest = max(fastest, abs(v))
    assert fastest < 0.65 * speed
    assert (law.made[-1] < sizes[-1]) == capped
    assert law.made[:2] == sizes[:2] and len(law.made) == len(sizes)
    assert max(efforts) == pytest.approx(28.0 + max(law.made))
    slow = np.abs(np.diff(efforts))
    steps = slow[slow > 0.5]
    assert steps == pytest.approx(np.repeat(law.made, 2))  # up and back; else no jump
    assert efforts[0] == efforts[-1] == 0.0


@pytest.mark.parametrize(
    ("low", "high", "flat", "ended"),
    [
        (None, None, 99.0, (0.0, 0.0)),
        (-1e-6, 4e-6, 99.0, (1.0, 1.0)),
        (None, None, 5e-6, (0.0, 2.0)),
    ],
)
def test_the_climb_turns_where_it_must(
    low: float | None, high: float | None, flat: float, ended: tuple[float, float]
) -> None:
    options = Options(8.0, 1.0, 1.0, 1.0, low, high, -2.0)

    class Still:
        dt = 1e-3

    law = piezo_drives.Climb(Work(Still(), options), 1e-6)  # type: ignore[arg-type]
    effort, most, least = 0.0, 0.0, 0.0
    for k in range(60_000):
        given = law(k * 1e-3, min(1e-6 * effort, flat), 0.0)
        if given is None:
            break
        assert abs(given - effort) <= 1.51 * law.rise
        effort = given
        most, least = max(most, effort), min(least, effort)
    assert given is None and abs(effort) < 1e-2
    assert (law.reached[-1.0][2], law.reached[1.0][2]) == ended
    assert most <= 8.0 and least >= -2.0
    expected = 8.0 if ended[1] == 0.0 else 4.0 if ended[1] == 1.0 else 5.4
    assert most == pytest.approx(expected, abs=0.25)
