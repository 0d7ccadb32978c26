"""Claims M1 to M16 on the bench, and the readings that they rest on (Chapter 4)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.thesis.ended import ended

from macromicro import loop
from macromicro.design import steps
from macromicro.lab import drive
from macromicro.plant import bench
from macromicro.programme import MACRO, Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.schema.par import replaced
from macromicro.settings import Settings
from macromicro.simulate import simulate
from macromicro.thesis import all_procedures
from macromicro.thesis.chapter4 import _design, control
from macromicro.thesis.chapter4.control import Square, tracking
from macromicro.thesis.claims import COMPUTED, DIFFERS, REPRODUCED, Claim

IDS = (
    *("M1", "M2", "M3", "M3b", "M4a", "M4b", "M5", "M6a", "M6b", "M7", "M8", "M9"),
    *("M10", "M11", "M11b", "M12", "M13", "M14", "M15", "M16"),
)


@pytest.fixture(scope="module")
def claims() -> dict[str, Claim]:
    procedures = [p for p in all_procedures() if p.name.startswith("macro-")]
    every = [c for p in procedures for c in ended(p.name).claims]
    found = {c.id: c for c in every}
    assert len(found) == len(every)
    return found


@pytest.mark.parametrize("name", IDS)
@pytest.mark.slow
def test_claim(claims: dict[str, Claim], name: str) -> None:
    """Every macro row of the thesis is measured and met within its tolerance."""
    claim = claims[name]
    assert claim.verdict == REPRODUCED, claim
    values = claim.measured if isinstance(claim.measured, list) else [claim.measured]
    assert values
    assert all(v is not None and math.isfinite(v) for v in values)


@pytest.mark.slow
def test_every_claim_is_listed(claims: dict[str, Claim]) -> None:
    assert set(claims) == set(IDS)
    assert {c.id for c in claims.values() if c.kind == COMPUTED} == {"M11", "M11b"}


@pytest.mark.slow
def test_measured_numbers(claims: dict[str, Claim]) -> None:
    """Accepted ranges once more, apart from the verdicts."""
    assert claims["M1"].measured == pytest.approx(3.0, abs=0.15)
    assert claims["M11"].measured == pytest.approx(4.91, rel=0.005)
    assert claims["M11b"].measured == pytest.approx([76.3, 9.91], rel=0.005)
    assert 0.6 <= claims["M14"].measured <= 0.95
    assert claims["M10"].measured[0] >= 1.0
    assert claims["M10"].measured[1] >= 2.0
    low, middle, high = (abs(v) for v in claims["M7"].measured)
    assert min(low, high) >= 4.0 * middle
    assert max(claims["M8"].measured) < 10.0
    assert claims["M13"].measured < 5.0
    assert claims["M16"].measured == pytest.approx(2800.0, abs=2.0)


@pytest.mark.slow
def test_ratio_of_the_thesis_saturates(claims: dict[str, Claim]) -> None:
    """Section 4.3.3 against itself: 1.05 asks for about 10 V; (4.10) for 37 + 3, then 6.72 V."""
    assert _design.trial(_design.at_ratio(1.05)).peak == pytest.approx(9.96, abs=0.05)
    printed = _design.trial(_design.TUNED_TAPS)
    assert printed.first == pytest.approx(0.0124593 * 3000.0 + 3.0)
    assert printed.peak == pytest.approx(6.72, abs=0.01)
    assert printed.saturated > 100
    assert _design.ratio_below_limit() > 1.5
    assert claims["M12"].measured == [0.0, 0.0, pytest.approx(0.863, abs=0.05)]


def test_sweeps_fall_with_ratio_and_frequency() -> None:
    """Figures 4.22, 4.23: peak effort falls along both; derivative time keeps overshoot off."""
    for sweep in (_design.sweep_ratios(), _design.sweep_frequencies()):
        peaks = [t.peak for t in sweep.values()]
        assert peaks == sorted(peaks, reverse=True)
    assert all(t.overshoot < 0.5 for t in _design.sweep_frequencies().values())
    assert all(t.overshoot > 5.0 for t in _design.sweep_frequencies(0.0).values())
    for w, t in _design.sweep_frequencies().items():
        assert t.crossover.frequency == pytest.approx(w, rel=1e-6)


class Blocks(list[np.ndarray]):
    """A sink for `simulate`."""


@pytest.mark.parametrize("name", control.LAWS)
@pytest.mark.slow
def test_drive_is_the_control_loop(name: str) -> None:
    """The runs here are those of the one control loop with parking off, bit for bit."""
    settings = replaced(Settings(), "controller.macro_law", name)
    settings = replaced(settings, "controller.sequence.park", 0)
    move = Programme(
        "", np.array([math.nan]), np.array([0]), np.array([1500.0]), np.array([1.0]), math.nan, ""
    )
    blocks = Blocks()
    simulate(settings, move, blocks)
    rows = dict(zip((c.name for c in COLUMNS), np.hstack(blocks), strict=True))
    plant = bench.prepare(settings.bench, settings.sensors)
    n = 900
    run = drive.closed_loop(plant, drive.law(name), np.full(n, 1500.0))
    assert len(rows["t"]) >= n
    assert run.dt == loop.PERIOD
    for column in ("macro_position", "motor", "macro_integral", "macro_reference"):
        np.testing.assert_array_equal(run[column], rows[column][:n], err_msg=column)


def test_full_travel_runs_where_it_is_told() -> None:
    """The move goes to the given runner, whole and with the given settings and seed."""
    asked = []

    def run(programme: Programme, settings: Settings, seed: int, fan: bool) -> Recording:
        asked.append((programme, settings, seed, fan))
        return Recording.from_arrays(COLUMNS[:1], [np.zeros(2)], 1e-3, {})

    settings = replaced(Settings(), "controller.macro_law", "pd-initial")
    kept = control.full_travel(settings, 7, run)
    (programme, used, seed, fan) = asked.pop()
    assert not asked
    assert len(kept) == 2
    assert (used, seed, fan) == (settings, 7, False)
    assert (programme.stage.tolist(), programme.target.tolist()) == ([MACRO], [2800.0])


def test_readings() -> None:
    """Rise, settling, overshoot, swings, sticking and sign changes of a made-up move."""
    x = np.array([0.0, 50.0, 98.0, 103.0, 101.0, 99.0, 99.0, 100.0, 100.0, 100.0])
    assert steps.rise_time(x, 100.0) == pytest.approx(2e-3)
    assert steps.settling_time(x, 100.0) == pytest.approx(4e-3)
    assert steps.overshoot(x, 100.0) == 3.0
    np.testing.assert_array_equal(steps.swings(x, 100.0), [4.0, 1.0])
    np.testing.assert_array_equal(steps.swings(-x, -100.0), [4.0, 1.0])
    assert not len(steps.swings(x, 500.0))
    assert math.isnan(steps.rise_time(x, 500.0))
    assert math.isnan(steps.settling_time(x, 500.0))
    assert control.sign_changes(np.array([1.0, 0.0, 2.0, -1.0, 0.0, 1.0])) == 2


def made(over: float, effort: np.ndarray, then: float) -> tuple[np.ndarray, np.ndarray]:
    """A rise to 2800 + `over` counts in 0.5 s, 4 s there under `effort` [V], then at `then`."""
    rise = np.linspace(0.0, 2800.0 + over, 501)
    x = np.concatenate([rise, np.full(4000, 2800.0 + over), np.full(100, then)])
    motor = np.concatenate([np.full(501, 4.0), effort, np.full(100, effort[-1])])
    return x, motor


DOWN = np.linspace(0.5, -2.5, 4000)


@pytest.mark.parametrize(
    ("over", "effort", "then", "good"),
    [
        (50.0, DOWN, 2849.0, True),  # sticks beyond the target until the effort turns it back
        (0.0, DOWN, 2799.0, False),  # at the target: nothing to wind up for
        (50.0, np.full(4000, -1.0), 2849.0, False),  # an effort that does not ramp
        (50.0, -DOWN, 2851.0, False),  # an effort that drives it farther away
        (50.0, DOWN, 2850.0, False),  # never turned back
        (50.0, DOWN - 1.0, 2849.0, False),  # beyond 3 V: more than stiction holds it
        (-50.0, -DOWN, 2751.0, False),  # short of the target: it goes on, it does not turn
    ],
)
def test_m9_asks_for_stiction_that_turns_back(
    over: float, effort: np.ndarray, then: float, good: bool
) -> None:
    """Section 4.3.1: a carriage that settles, or behaves the other way round, fails."""
    x, motor = made(over, effort, then)
    names = ("t", "macro_position", "motor")
    columns = [next(c for c in COLUMNS if c.name == n) for n in names]
    run = Recording.from_arrays(columns, [np.arange(len(x)) * 1e-3, x, motor], 1e-3, {})
    assert (control.pid(run).verdict == REPRODUCED) == good


def test_a_stuck_carriage_reproduces_nothing() -> None:
    """M9, M12, M13, M14 and M15 by runs in which nothing moves."""
    reference = control.decaying()
    names = ("t", "macro_position", "motor")
    columns = [next(c for c in COLUMNS if c.name == n) for n in names]
    n = 5000
    ramp = np.linspace(0.5, 2.9, n)
    run = Recording.from_arrays(columns, [np.arange(n) * 1e-3, np.zeros(n), ramp], 1e-3, {})
    assert control.pid(run).verdict == DIFFERS
    assert control.full_move(run).verdict == DIFFERS
    still = np.full(len(reference), 1400.0) + 1e-3 * np.sign(reference - 1400.0)
    square = Square(reference, dict.fromkeys(control.LAWS, still), still)
    assert control.tuned_pd(square).verdict == DIFFERS
    assert control.ranking(square).verdict == DIFFERS


def test_ranking_can_fail() -> None:
    """M13 and M15 differ when the tuned law's run is as bad as the PID's."""
    reference = control.decaying()
    good = reference.copy()
    bad = reference + 40.0 * np.sin(np.arange(len(reference)) / 20.0)
    square = Square(reference, {"pid": bad, "pd-initial": good, "pd-tuned": bad}, good)
    assert control.ranking(square).verdict == DIFFERS
    assert control.tuned_pd(square).verdict == DIFFERS
    assert tracking(bad, reference).largest > 1.0
