"""A shape-memory wire commissioned as a whole; its model by itself."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.commission.stages import stage

from macromicro.commission import (
    _store,
    _wire_drives,
    _wire_fit,
    report,
    wire,
)
from macromicro.commission._wire_drives import HOLD
from macromicro.commission._wire_fit import Heat
from macromicro.commission.procedure import Options, Work
from macromicro.commission.running import Commissioned, Place, commission
from macromicro.commission.stand import CommissionError, Record
from macromicro.kernel import compiled
from macromicro.machines import machine, wire_sheets

PLAIN = Heat(1.0, 0.1, 10.0, 2.0, 4.0, 5.0, 3.0, 2.0, 4e-3, 0.8, -0.5)
Done = tuple[Commissioned, Place, Options, Path, list[str]]


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Done:
    out = tmp_path_factory.mktemp("wire")
    place, options, _ = stage("wire-100um.toml", turned=True)
    said: list[str] = []
    found = commission(
        place, options, out, ask=lambda title, intent: said.append(f"{title}: {intent}")
    )
    report.write(out, found, place, "2026-01-01 12:00:00")
    return found, place, options, out, said


@pytest.mark.slow
def test_it_finds_the_wire_and_verifies_it(done: Done) -> None:
    found, place, _, _, _ = done
    tree = stage("wire-100um.toml")[2]
    assert found.model.heat.way == pytest.approx(wire_sheets.way(tree), rel=2e-3)
    heat = found.model.heat
    assert heat.start < heat.end and heat.last < heat.first < heat.end
    assert found.verified.met
    assert found.work[wire.WARMTH].sign == -1.0
    assert not place.kind.doubts(found.work, found.model)
    assert found.margins.doubts == ()
    name, value, least, unit = found.margins.rows[1]
    assert (name, unit) == ("phase margin", "deg")
    assert 30.0 < 0.9 * float(value) < float(least.removeprefix(">= ")) <= float(value) < 90.0


@pytest.mark.slow
def test_every_step_says_how_far_and_how_hard(done: Done) -> None:
    said = done[4]
    assert len(said) == 5
    assert "10 V at most" in said[0] and "is removed" in said[0]
    assert "0.25 V/s" in said[1]
    assert "to 10 V" in said[2] and "4.07 mm" in said[2]
    assert "3.05, 2.03, 1.02 mm" in said[3]
    assert "7 moves" in said[4]


@pytest.mark.slow
def test_the_file_runs_and_says_what_was_found(done: Done, monkeypatch: pytest.MonkeyPatch) -> None:
    found, place, _, out, _ = done
    kind, tree = machine.load(out / report.MACHINE)
    assert kind.name == "wire" and tree == found.settings
    heat, model = found.model.heat, found.model
    assert wire_sheets.way(tree) == pytest.approx(heat.way, rel=1e-2)
    # Its rules find the resistance, and so the time constant, again.
    heats = wire_sheets.heats(tree)
    tau = heats.capacity * heats.resistance
    assert tau == pytest.approx(heat.tau / (1.0 - heat.share), rel=1e-6)
    full = wire_sheets.power(tree) * heats.resistance
    kelvin = (tree.wire.heat_start - tree.air.ambient) / heat.start
    assert full / kelvin == pytest.approx(tree.driver.full_scale, rel=1e-6)
    dt = found.work.stand.dt
    answer = _wire_fit.answer(found.work[wire.CURVES][0], heat, dt)
    assert 1.5 < answer < 3.0
    assert tree.controller.kp == pytest.approx(answer * wire_sheets.bandwidth(tree) / model.up)
    page = (out / report.PAGE).read_text()
    assert page.count("data:image/png;base64,") == len(place.kind.figures) + 1
    kept = _store.read_steps(out, place.kind, place.asked(done[2]))
    stand = found.work.stand
    assert wire.fit(Work(stand, done[2], kept)).heat == heat
    # A sensor without noise is uncertain by its steps.
    quiet = {**kept, wire.WARMTH: kept[wire.WARMTH]._replace(noise=0.0)}
    monkeypatch.setattr(_wire_fit, "fit_wire", lambda records, dt, way, noise: noise)
    assert wire.fit(Work(stand, done[2], quiet)) == stand.pitch / math.sqrt(12.0)


@given(st.floats(0.0, 1.0), st.floats(-3.0, 3.0))
def test_a_branch_and_its_inverse(q: float, bend: float) -> None:
    z = _wire_fit.branch(q, bend)
    assert 0.0 <= z <= 1.0
    assert _wire_fit.along(z, bend) == pytest.approx(q, abs=1e-6)
    step = 1e-6
    if step < q < 1.0 - step:
        slope = _wire_fit.branch(q + step, bend) - _wire_fit.branch(q - step, bend)
        assert _wire_fit.steepness(z, bend) == pytest.approx(slope / (2.0 * step), rel=1e-3)


def test_a_branch_ends_where_it_ends() -> None:
    assert (_wire_fit.branch(-1.0, 0.5), _wire_fit.branch(2.0, 0.5)) == (0.0, 1.0)
    assert _wire_fit.branch(0.3, 0.0) == 0.3
    assert _wire_fit.branch(0.5, 1.0) < 0.5 < _wire_fit.branch(0.5, -1.0)


def record(p: Heat, efforts: list[tuple[float, float]], dt: float = 5e-3) -> Record:
    u = np.concatenate([np.full(round(s / dt), v) for v, s in efforts])
    t = np.arange(len(u)) * dt
    return Record(t, u, _wire_fit.simulate(p, Record(t, u, np.zeros_like(u))))


def test_a_wire_at_rest_keeps_its_heat() -> None:
    # Steady: h = u, wherever it flows.
    assert record(PLAIN, [(3.9, 300.0)]).x[-1] == 0.0
    assert record(PLAIN, [(5.1, 300.0)]).x[-1] == pytest.approx(PLAIN.way)
    half = record(PLAIN, [(4.5, 300.0)]).x[-1]
    assert half == pytest.approx(PLAIN.way * _wire_fit.branch(0.5, PLAIN.warming), rel=1e-3)
    # And the loop: between both branches it stays as it is.
    assert record(PLAIN, [(5.1, 300.0), (3.1, 300.0)]).x[-1] == pytest.approx(PLAIN.way)
    back = record(PLAIN, [(5.1, 300.0), (2.5, 300.0)]).x[-1]
    assert back == pytest.approx(PLAIN.way * _wire_fit.branch(0.5, PLAIN.cooling), rel=1e-3)
    assert record(PLAIN, [(5.1, 300.0), (1.9, 300.0)]).x[-1] == 0.0


def test_heat_is_conserved_while_it_contracts() -> None:
    p = PLAIN._replace(share=1e-9, warming=0.0)
    push = 1000.0  # so quick that nothing is lost
    one = record(p, [(push, 0.05)], 1e-5)
    begin, end = (float(one.t[int(np.argmax(one.x >= s))]) for s in (1e-9, p.way * (1 - 1e-9)))
    assert begin * push == pytest.approx(p.tau * p.start, rel=0.02)
    assert (end - begin) * push == pytest.approx(p.tau * (p.end - p.start) + p.latent, rel=0.02)


def test_the_compiled_run_is_the_interpreted_one() -> None:
    u = np.array([8.0] * 300 + [0.0] * 300)
    out, same, begin = np.empty(600), np.empty(600), _wire_fit.Begin(0.5, 0.2)
    _wire_fit.free_run(PLAIN, begin, u, 0.01, out)
    compiled(_wire_fit.free_run)(PLAIN, begin, u, 0.01, same)
    assert np.ptp(out) > 0.0
    assert out == pytest.approx(same, rel=1e-12, abs=1e-15)


@given(st.floats(0.0, 12.0), st.floats(0.0, 1.0), st.booleans(), st.floats(-3.0, 3.0))
def test_heat_and_contraction_hold_their_content(
    content: float, z: float, warming: bool, bend: float
) -> None:
    p = PLAIN._replace(warming=bend, cooling=-bend)
    h, now = _wire_fit.settled(p, content, z, warming)
    assert p.tau * h + p.latent * now == pytest.approx(content, abs=1e-8)
    # It is on its branch, or moved along none.
    at, over, own = (p.start, 1.0, bend) if warming else (p.last, 1.0, -bend)
    on = _wire_fit.branch((h - at) / over, own)
    assert now == pytest.approx(max(z, on) if warming else min(z, on), abs=1e-8)


def test_a_free_run_changes_smoothly_with_the_parameters() -> None:
    # A search by differences needs it: the branches begin between two samples.
    efforts = [(8.0, 2.0), (5.5, 2.0), (0.0, 6.0)]
    starts = 4.0 + 1e-3 * np.arange(40)
    mean = np.array([record(PLAIN._replace(start=s), efforts, 0.05).x.mean() for s in starts])
    slopes = np.diff(mean)
    assert slopes.max() < 0.0
    assert np.ptp(slopes) < 0.05 * np.abs(slopes.mean())


def test_warmth_at_the_begin_is_not_lost() -> None:
    cold, warm = (
        _wire_fit.simulate(PLAIN, record(PLAIN, [(8.0, 3.0)]), begin)
        for begin in (_wire_fit.COLD, _wire_fit.Begin(1.0, 0.5))
    )
    assert int(np.argmax(warm > 0.0)) < int(np.argmax(cold > 0.0))


def rose_and_fell(p: Heat, dt: float) -> Record:
    u = np.arange(0.0, 8.0, 0.25 * dt)
    u = np.concatenate([u, u[::-1]])
    t = np.arange(len(u)) * dt
    return Record(t, u, _wire_fit.simulate(p, Record(t, u, np.zeros_like(u))))


@pytest.mark.parametrize("tau", [0.3, pytest.param(4.2, marks=pytest.mark.slow)])
def test_a_wire_is_found_again(tau: float) -> None:
    dt = 0.02
    p = PLAIN._replace(tau=tau, slow=10.0 * tau, latent=2.0 * tau)
    pulses: list[tuple[float, float]] = []
    for push in (8.0, 10.0, 7.0, 9.0):
        pulses += [(push, 4.0 * tau), (5.5, 6.0 * tau), (0.0, 8.0 * tau)]
    found = _wire_fit.fit_wire([rose_and_fell(p, dt), record(p, pulses, dt)], dt, p.way, 1e-7)
    assert found.heat.tau == pytest.approx(p.tau, rel=0.02)
    assert found.up == pytest.approx(_wire_fit._up(p), rel=0.02)
    for name in ("start", "end", "first", "last"):
        assert getattr(found.heat, name) == pytest.approx(getattr(p, name), rel=0.02), name
    assert found.rms < 0.005 * p.way
    # What is left out is part of the interval.
    assert found.half_width("tau") >= 2.0 * 0.06 * found.heat.tau
    assert found.half_width("way") == pytest.approx(1.96 * np.sqrt(2.0) * 1e-7)


def test_the_search_begins_at_quick_and_slow_wires() -> None:
    dt = 0.02
    pulses = record(PLAIN, [(8.0, 4.0), (5.5, 6.0), (0.0, 8.0)], dt)
    taus = {g[0] for g in _wire_fit.guesses(rose_and_fell(PLAIN, dt), pulses, PLAIN.way)}
    assert len(taus) == 3 and min(taus) < 0.5 * PLAIN.tau and max(taus) > 2.0 * PLAIN.tau


class Bench:
    """A wire without noise, by its model."""

    def __init__(self, p: Heat, rest: float = 0.0) -> None:
        self.p, self.rest, self.x = p, rest, 0.0
        self.dt, self.pitch, self.facing = 0.02, 1e-7, 1.0
        self.content = self.z = 0.0

    def drive(self, law: object, seconds: float, caution: object) -> Record:
        assert callable(law)
        rows = []
        h = (self.content - self.p.latent * self.z) / self.p.tau
        for k in range(round(seconds / self.dt)):
            x = max(self.p.way * self.z, self.rest)
            u = law(k * self.dt, x, 0.0)
            rows.append((k * self.dt, u or 0.0, x))
            if u is None:
                break
            push = u - h
            self.content += push * self.dt
            h, self.z = _wire_fit.settled(self.p, self.content, self.z, push > 0.0)
        return Record(*np.array(rows).T)


def test_a_hot_wire_that_stands_is_not_taken_for_a_cold_one() -> None:
    bench = Bench(PLAIN._replace(tau=8.0, first=1.0, last=0.5))
    work = Work(bench, Options(10.0, 1.0, 1.0, 1.0, lowest=0.0))  # type: ignore[arg-type]
    bench.drive(lambda t, x, v: 10.0, 12.0, None)
    assert bench.z == 1.0
    _wire_drives.cool(bench, 1e-6, work, 0.0, PLAIN.way)  # type: ignore[arg-type]
    assert bench.z == 0.0
    stuck = Bench(PLAIN, rest=1e-3)
    with pytest.raises(CommissionError, match="still contracted after"):
        _wire_drives.cool(stuck, 1e-6, work, 0.0, PLAIN.way)  # type: ignore[arg-type]


@pytest.mark.parametrize(("way", "words"), [(0.0, "nothing contracts")])
def test_what_does_not_contract_is_said(way: float, words: str) -> None:
    class Dead:
        dt, pitch, facing = 1e-2, 1e-6, 1.0

        def drive(self, law: object, seconds: float, caution: object) -> Record:
            assert callable(law)
            rows = []
            for k in range(round(seconds / self.dt)):
                u = law(k * self.dt, way, 0.0)
                if u is None:
                    break
                rows.append((k * self.dt, u, way))
            return Record(*np.array(rows).T)

    options = Options(5.0, 1.0, 1.0, 1.0, lowest=0.0)
    with pytest.raises(CommissionError, match=words):
        _wire_drives.warmth(Work(Dead(), options))  # type: ignore[arg-type]


@pytest.mark.slow
def test_first_order_curves_of_the_wire(done: Done) -> None:
    found = done[0]
    dt, heat = found.work.stand.dt, found.model.heat
    seen = _wire_fit.curves(found.work[wire.CURVES][0], heat, dt)
    assert len(seen.every) == len(_wire_drives.TURNS) + 1
    lows = [float(one.x.min()) / heat.way for one in seen.every]
    assert all(low < share for low, share in zip(lows, (*_wire_drives.TURNS, 0.05), strict=True))
    assert lows[0] > lows[1] > lows[2] > 0.1
    # Each curve lies in the loop, and answers less than the branch the shallower it turned.
    ratios = _wire_fit.slower(seen)
    assert ratios == sorted(ratios, reverse=True) and min(ratios) > 1.0
    width = 0.5 * (heat.start + heat.end - heat.first - heat.last)
    assert 0.0 < _wire_fit.spread(seen) < 0.05 * width


@pytest.mark.slow
def test_the_heat_along_curves_is_that_of_the_model_and_a_draught_is_seen(done: Done) -> None:
    # Of a wire that is the model, the heat is the effort wherever it stands long enough.
    one = record(PLAIN, [(4.6, 100.0), (3.0, 100.0), (4.9, 100.0), (0.5, 100.0)])
    heat = _wire_fit.heat_along(PLAIN, one)
    ends = [int(k / 5e-3) - 2 for k in (100.0, 200.0, 300.0, 400.0)]
    assert heat[ends] == pytest.approx([4.6, 3.0, 4.9, 0.5], abs=0.02)
    work = done[0].work
    other = Work(work.stand, work.options, dict(work.found))
    kept = work[wire.CURVES][0]
    cooler = np.linspace(1.0, 0.7, len(kept.t))
    other.found[wire.CURVES] = [kept._replace(u=kept.u * cooler)]
    assert any("V apart" in said for said in wire.doubts(other, done[0].model))


def test_a_branch_like_curve_answers_as_the_branch_does() -> None:
    h = np.linspace(0.0, 10.0, 1001)
    first = (h, np.clip(h - 5.0, 0.0, 2.0))
    down = (h[::-1], np.clip(h[::-1] - 3.0, 0.0, 2.0))

    def back(slope: float) -> _wire_fit.Curve:
        x = np.clip(1.0 + slope * (h - 6.0), 1.0, 2.0)
        low = down[1] >= 1.0
        both = [np.concatenate(p) for p in ((down[0][low], h), (down[1][low], x))]
        return _wire_fit.Curve(both[0], both[1], int(low.sum()))

    seen = _wire_fit.Curves(first, [back(1.0), back(0.4), _wire_fit.Curve(*down, 1000)])
    assert _wire_fit.slower(seen) == pytest.approx([1.0, 2.5], rel=0.05)


class Thick:
    """A wire that follows its effort late; contracted at 9 V, if it is given the time."""

    dt, pitch, facing = 1e-2, 1e-6, 1.0

    def __init__(self, lag: float) -> None:
        self.lag, self.x, self.efforts = lag, 0.0, list[float]()

    def drive(self, law: object, seconds: float, caution: object) -> Record:
        assert callable(law)
        rows = []
        for k in range(round(seconds / self.dt)):
            u = law(k * self.dt, self.x, 0.0)
            if u is None:
                break
            rows.append((k * self.dt, u, self.x))
            share = min(max((u - 5.0) / 4.0, 0.0), 1.0)
            self.x += (4e-3 * share - self.x) * self.dt / self.lag
        self.efforts = [row[1] for row in rows]
        return Record(*np.array(rows).T)


def test_a_wire_that_follows_late_is_given_time_at_the_largest_effort() -> None:
    options = Options(10.0, 1.0, 1.0, 1.0, lowest=0.0)
    bench = Thick(2.0)
    work = Work(bench, options)  # type: ignore[arg-type]
    work.found["warmth"] = _wire_drives.Warmth(1.0, 1.0, 0.0)
    (record,) = _wire_drives.ramp(work)
    held = np.count_nonzero(record.u == 10.0) * bench.dt
    assert 0.5 < held < HOLD and record.u.max() == 10.0
    work.found["ramp"] = [record]
    assert _wire_drives.way_of(work) == pytest.approx(4e-3, rel=5e-3)
    slow = Thick(60.0)
    work = Work(slow, options, {"warmth": _wire_drives.Warmth(1.0, 1.0, 0.0)})  # type: ignore[arg-type]
    with pytest.raises(CommissionError, match="still contracts at 10 V"):
        _wire_drives.ramp(work)
    held = np.count_nonzero(np.array(slow.efforts) == 10.0) * slow.dt
    assert held == pytest.approx(HOLD, abs=0.1)
