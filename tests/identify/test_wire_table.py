"""The better actuator model fitted: its time grid, where CONTRACT acts, and a fit of made runs."""

from __future__ import annotations

import math
import warnings
from typing import Any, NamedTuple

import numpy as np
import pytest

from macromicro.columns import Column
from macromicro.errors import InputError
from macromicro.hysteresis import from_density
from macromicro.hysteresis.table import FodTable
from macromicro.identify import wire
from macromicro.identify.notices import ConvergenceWarning, DataWarning
from macromicro.identify.wire import Parameter, by_parameter, search_values
from macromicro.identify.wire_model import hysteresis
from macromicro.identify.wire_table import (
    MOST_VOLTAGES,
    grid_recording,
    means,
    parameters_of,
    switching_positions,
    too_slow,
    wires_of,
    with_table,
)
from macromicro.models import stressed
from macromicro.models.heating import Ladder
from macromicro.recording import Recording

COLUMNS = tuple(Column(n, "", "") for n in ("t", "laser", "ctrl", "contract"))
TABLE = FodTable.from_everett(
    from_density(
        lambda up, down: np.where((up > 45.0) & (up - down > 10.0) & (up - down < 30.0), 1.0, 0.0),
        20.0, 1.0, 91,
    ), 0.0, 4.0,
)  # fmt: skip


def recorded(
    ctrl: np.ndarray, x: np.ndarray, dt: float, contract: np.ndarray | None = None
) -> Recording:
    """Positions [mm]."""
    t = np.arange(len(ctrl)) * dt
    shut = np.zeros(len(ctrl)) if contract is None else contract
    columns = COLUMNS if contract is not None else COLUMNS[:3]
    return Recording.from_arrays(columns, [t, 1e3 * x, ctrl, shut][: len(columns)], dt, {})


def test_the_time_grid_is_fine_after_each_change_of_ctrl() -> None:
    """2 ms for two seconds, 10 ms up to ten, then 50 ms; here with one change after 15 s."""
    ctrl = np.where(np.arange(20001) < 15000, 1.5, 1.6)
    run = grid_recording(recorded(ctrl, np.zeros(20001), 1e-3))
    starts = np.r_[0.0, np.cumsum(run.dt)[:-1]]
    assert np.sum(run.dt) == pytest.approx(20.0)
    for begin, end, step in ((0.0, 2.0, 0.002), (2.0, 10.0, 0.01), (10.0, 15.0, 0.05),
                             (15.0, 17.0, 0.002), (17.0, 20.0, 0.01)):  # fmt: skip
        mine = (starts > begin - 1e-6) & (starts < end - 1e-6)
        np.testing.assert_allclose(run.dt[mine], step, atol=1e-9)
        assert mine.sum() == round((end - begin) / step)
    np.testing.assert_array_equal(run.ctrl, np.where(starts < 15.0 - 1e-6, 1.5, 1.6))
    assert (run.cut == 0.0).all()


def test_a_coarse_record_keeps_all_its_samples() -> None:
    run = grid_recording(recorded(np.full(101, 1.5), np.zeros(101), 0.1))
    np.testing.assert_allclose(run.dt, 0.1)
    assert len(run.dt) == 100


@pytest.mark.parametrize("dt", [0.01, 0.00999999999999801, 0.0100000000000021])
def test_no_step_of_the_time_grid_is_empty_where_a_files_period_is_not_exact(dt: float) -> None:
    ctrl = np.r_[np.full(1500, 1.5), np.zeros(600)]
    run = grid_recording(recorded(ctrl, np.zeros(2100), dt))
    assert run.dt.min() > 0.5 * dt and np.isfinite(run.cut).all()
    assert len(run.dt) == len(grid_recording(recorded(ctrl, np.zeros(2100), 0.01)).dt)


def test_positions_are_met_at_points_spread_evenly_over_thegridded() -> None:
    x = np.arange(20001) * 1e-4
    run = grid_recording(recorded(np.full(20001, 1.5), x, 1e-3))
    starts = np.r_[0.0, np.cumsum(run.dt)[:-1]]
    assert len(run.at) == 150 and run.at[0] == 1 and run.at[-1] == len(run.dt) - 1
    assert np.ptp(np.diff(run.at)) <= 1
    np.testing.assert_allclose(run.x, 0.1 * starts[run.at])


def test_the_share_of_time_cut_is_that_of_each_step() -> None:
    contract = np.zeros(3001)
    contract[2005:2008] = 1.0
    contract[100] = 1.0
    run = grid_recording(recorded(np.full(3001, 1.5), np.zeros(3001), 1e-3, contract))
    starts = np.round(np.r_[0.0, np.cumsum(run.dt)[:-1]], 9)
    assert run.cut[starts == 0.1] == 0.5  # one of two milliseconds
    assert run.cut[starts == 2.0] == pytest.approx(0.3)  # three of ten
    assert np.count_nonzero(run.cut) == 2


def switching(*places: float) -> Recording:
    """CONTRACT closes at the first of these positions, opens at the second, and so on."""
    contract = np.repeat(np.arange(len(places) + 1) % 2, 10).astype(float)
    x = np.zeros(len(contract))
    x[10::10] = places
    return recorded(1.5 * np.ones(len(contract)), x, 0.01, contract)


@pytest.mark.parametrize(
    ("places", "on", "off"),
    [
        ((3.9, 3.8), 3.9, 3.8),
        ((3.9, 3.8, 3.7, 3.6, 3.8, 3.7), 3.8, 3.7),  # medians of each
        ((3.9,), 3.9, 3.89),  # it never opens: 10 um below
        ((3.9, 3.899), 3.9, 3.898),  # apart by 2 um at least
        ((4.1, 4.0), 3.998, 3.898),  # moved down to what the table reaches
    ],
)
def test_where_contract_acts_is_the_middle_of_where_it_did(
    places: tuple[float, ...], on: float, off: float
) -> None:
    none = recorded(np.ones(20), np.zeros(20), 0.01)
    assert switching_positions([none, switching(*places)], 4.0) == (
        pytest.approx(on),
        pytest.approx(off),
    )
    assert switching_positions([none], 4.0) == (math.inf, math.inf)
    assert switching_positions([recorded(np.ones(9), np.zeros(9), 0.01, np.zeros(9))], 4.0) == (
        math.inf,
        math.inf,
    )


VOLTS = np.array([0.0, 1.5, 1.6])
KNOWN = {
    **{"volts": VOLTS, "lag": 0.0, "cut_on": 3.9, "cut_off": 3.8},
    **{"ambient": 25.0, "hysteresis": hysteresis(TABLE)},
}
NAMES = ("c1", "r1", "c2", "r2", "c3", "latent", "shift", "stiffening")
TRUTH = np.array([0.9, 0.7, 30.0, 0.22, 1200.0, 15.0, 1.0, 0.8, 58.0, 80.0])


def actuator(known: dict[str, Any], theta: np.ndarray) -> stressed.Stressed:
    return wires_of(known, {str(k): float(v) for k, v in enumerate(theta)})


def test_values_go_to_their_places_in_the_model() -> None:
    """The resistances add up to 1, as far as the third stays above 0.002."""
    p = actuator(KNOWN, TRUTH)
    assert p.heat.tolist() == [0.0, 58.0, 80.0]
    assert p.ladder == (0.9, 0.7, 30.0, 0.22, 1200.0, pytest.approx(0.08))
    assert (p.latent, p.shift, p.stiffening) == (15.0, 1.0, 0.8)
    assert (p.volts is VOLTS, p.cut_on, p.ambient) == (True, 3.9, 25.0)
    wide = TRUTH.copy()
    wide[1] = 0.95
    assert actuator(KNOWN, wide).ladder.r3 == 0.002


NEAR = np.array([0.8, 0.75, 40.0, 0.2, 1500.0, 20.0, 0.5, 0.5, 62.0, 76.0])


def made(*levels: float, seconds: float = 2.0) -> Recording:
    """A free run of the model that NEAR gives, so long at each voltage, with 2 um of noise."""
    ctrl = np.repeat(levels, round(seconds / 0.02)).astype(float)
    x = stressed.simulate(actuator(KNOWN, NEAR), ctrl, 0.02)[0]
    noise = np.random.default_rng(len(levels)).normal(0.0, 0.002, len(x))
    return recorded(ctrl, x + noise, 0.02)


def test_a_model_is_found_again_from_its_own_runs() -> None:
    """To less than the table's own error; heats are named by their voltages."""
    runs = [made(1.5, 0.0, 1.6, 0.0, seconds=25.0), made(1.6, 1.5, 0.0, seconds=25.0)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = with_table(TABLE, runs)
    assert list(found.values) == [*NAMES, "heat 1.5 V", "heat 1.6 V"] == list(found.std)
    assert found.rms == pytest.approx(0.002, rel=0.2)
    assert found.model.wires.volts.tolist() == [0.0, 1.5, 1.6]
    assert found.values["heat 1.5 V"] == found.model.wires.heat[1] == pytest.approx(62.0, rel=0.05)
    assert found.values["heat 1.6 V"] == found.model.wires.heat[2] == pytest.approx(76.0, rel=0.05)
    assert (found.model.wires.cut_on, found.model.wires.ambient, found.model.wires.lag) == (
        math.inf,
        25.0,
        0.0,
    )
    assert all(0.0 < s < math.inf for s in found.std.values())
    # Moves of this wire take three times as long as the thesis': steps four times as long.
    assert means(TABLE, runs, 25.0).pace == pytest.approx(1.45, rel=0.05)
    error = np.concatenate([
        stressed.simulate(found.model.wires, r.ctrl, r.dt, r.cut)[0][r.at] - r.x
        for r in (grid_recording(run, 4.0) for run in runs)
    ])  # fmt: skip
    assert found.rms == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-6)
    assert 1 < found.iterations <= 40
    known = KNOWN | {"cut_on": math.inf, "cut_off": math.inf}
    ratio = list(found.std.values()) / textbook_errors(known, found.values, runs)
    assert np.all((ratio > 0.5) & (ratio < 2.0))  # slopes by other steps
    for name, true in zip(found.values, NEAR, strict=True):
        assert found.values[name] == pytest.approx(true, abs=4.0 * found.std[name]), name
    again = with_table(TABLE, runs, near=found)
    assert again.rms == pytest.approx(found.rms, rel=1e-4)


def foreign(unit: float, slow: float) -> tuple[stressed.Stressed, list[Recording]]:
    """Wires that are `slow` times as slow as the thesis', more strained, on a driver in other
    units: heat by the square of the drive above a threshold."""
    volts = unit * np.linspace(0.0, 12.0, 49)
    heat = 300.0 * np.maximum((volts / unit - 2.0) / 10.0, 0.0) ** 2
    ladder = Ladder(0.8 * slow, 0.6, 40.0 * slow, 0.3, 150.0 * slow, 0.1)
    p = stressed.Stressed(
        volts, heat, 0.0, ladder, 40.0, -12.0, 8.0, math.inf, math.inf, 18.0, hysteresis(TABLE)
    )
    runs = []
    for levels in ((7.0, 0.0), (9.0, 0.0), (8.0, 6.5, 7.5, 0.0, 10.0, 0.0)):
        ctrl = unit * np.repeat(levels, 1500).astype(float)
        dt = 0.02 * slow
        x = stressed.simulate(p, ctrl, dt)[0]
        random = np.random.default_rng(len(runs))
        runs.append(recorded(ctrl, x + random.normal(0.0, 0.002, len(x)), dt))
    return p, runs


@pytest.mark.parametrize(("unit", "slow"), [(0.05, 0.2), (2000.0, 6.0)])
def test_the_search_begins_by_table_and_records_not_by_the_thesis(unit: float, slow: float) -> None:
    """Drives of 0 to 0.5 and of 0 to 20 000, wires of 0.1 and of 3 s: none is at a bound."""
    p, runs = foreign(unit, slow)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = with_table(TABLE, runs, ambient=18.0)
    assert found.rms == pytest.approx(0.002, rel=0.15)
    assert found.values["c1"] == pytest.approx(0.8 * slow, rel=0.1)
    assert found.values["shift"] == pytest.approx(-12.0, abs=1.0)
    assert found.values["stiffening"] == pytest.approx(8.0, rel=0.1)
    for level, heat in zip(found.model.wires.volts, found.model.wires.heat, strict=True):
        assert heat == pytest.approx(np.interp(level, p.volts, p.heat), rel=0.1)


def test_what_table_and_records_say_before_the_search() -> None:
    """The warming to where the table is half contracted; wires six times as slow take six times
    as long."""
    quick, slow = (means(TABLE, foreign(1.0, k)[1], 18.0) for k in (1.0, 6.0))
    assert quick.volts.tolist() == [0.0, 6.5, 7.0, 7.5, 8.0, 9.0, 10.0]
    assert quick.warming == pytest.approx(float(np.interp(2.0, *TABLE.major_loop[1::-1])) - 18.0)
    assert slow.pace == pytest.approx(6.0 * quick.pace, rel=0.05)
    assert (quick.shortest, quick.longest) == (0.02, pytest.approx(180.0))


def test_what_warms_longer_than_any_record_is_said() -> None:
    ladder = Ladder(0.9, 0.7, 30.0, 0.2, 1200.0, 0.1)
    assert too_slow(ladder, 121.0) == ""
    assert too_slow(ladder, 100.0) == "c3 r3 (120 s) is"
    assert too_slow(ladder, 5.0) == "c2 r2 (6 s) and c3 r3 (120 s) are"
    with pytest.warns(DataWarning, match=r"c2 r2 .* longer than the longest record \(4 s\)"):
        with_table(TABLE, [made(1.5, 0.0), made(1.6, 0.0)])


def textbook_errors(
    known: dict[str, Any], values: dict[str, float], runs: list[Recording]
) -> np.ndarray:
    """Textbook: variance of what is left, times the inverse of the slopes' products."""
    grids = [grid_recording(run) for run in runs]

    def residual(theta: np.ndarray) -> np.ndarray:
        p = actuator(known, theta)
        return np.concatenate([
            stressed.simulate(p, g.ctrl, g.dt, g.cut)[0][g.at] - g.x for g in grids
        ])  # fmt: skip

    theta = np.array(list(values.values()))
    slopes = []
    for k in range(len(theta)):
        by = np.zeros(len(theta))
        by[k] = 5e-4 * abs(theta[k])
        slopes.append((residual(theta + by) - residual(theta - by)) / (2.0 * by[k]))
    j, left = np.array(slopes).T, residual(theta)
    variance = float(left @ left) / (len(left) - len(theta))
    return np.sqrt(np.diag(np.linalg.inv(j.T @ j)) * variance)


def test_what_cannot_be_fitted_is_refused() -> None:
    run = made(1.5)
    with pytest.raises(InputError, match="2 open-loop recordings"):
        with_table(TABLE, [run])
    still = recorded(np.full(50, 1.5), np.zeros(50), 0.02)
    with pytest.raises(InputError, match=r"no level moves the wires by 2 % of 4 mm"):
        with_table(TABLE, [still, still])
    many = recorded(np.linspace(0.3, 1.9, MOST_VOLTAGES + 1), np.linspace(0.0, 3.0, 61), 0.02)
    with pytest.raises(InputError, match=r"61 different levels.*at most 60"):
        with_table(TABLE, [many, still])
    with pytest.raises(InputError, match=r"ambient.*less than .* deg C"):
        with_table(TABLE, [run, run], ambient=90.0)


def test_a_search_that_is_cut_short_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy import optimize

    real = optimize.least_squares
    monkeypatch.setattr(optimize, "least_squares", lambda *a, **k: real(*a, **{**k, "max_nfev": 1}))
    with pytest.warns(ConvergenceWarning, match="before it settled"):
        with_table(TABLE, [made(1.5, 0.0), made(1.6, 0.0)])


class Answer(NamedTuple):
    """What least squares would return."""

    x: np.ndarray
    fun: np.ndarray
    jac: np.ndarray
    cost: float
    status: int
    nfev: int


def answering(monkeypatch: pytest.MonkeyPatch, answer: Answer) -> list[np.ndarray]:
    """Least squares that returns `answer`; where it was told to start."""
    starts: list[np.ndarray] = []

    def least_squares(residual: Any, start: np.ndarray, *_: Any, **options: Any) -> Answer:
        starts.append(start)
        return answer

    monkeypatch.setattr("scipy.optimize.least_squares", least_squares)
    return starts


def answer(n: int, status: int = 1) -> Answer:
    """Of `n` residuals and nine search values: one voltage."""
    random = np.random.default_rng(n)
    fun = random.normal(size=n)
    found = np.where(np.isin(np.arange(9), [0, 2, 4]), np.log(TRUTH[:9]), TRUTH[:9])
    return Answer(found, fun, random.normal(size=(n, 9)), 0.5 * float(fun @ fun), status, 7)


def test_standard_errors_are_those_of_what_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of white residuals about sigma^2 (J'J)^-1; residuals count in units of 10 um."""
    given = answer(3000)
    answering(monkeypatch, given)
    found = with_table(TABLE, [made(1.5, seconds=14.0), made(1.5, 0.0)])
    inverse = np.linalg.inv(given.jac.T @ given.jac)
    wanted = np.sqrt(np.diag(inverse) * float(np.mean(given.fun**2)))
    wanted[[0, 2, 4]] *= TRUTH[[0, 2, 4]]  # times are searched in their logarithms
    np.testing.assert_allclose(list(found.std.values()), wanted, rtol=0.35)
    assert found.rms == pytest.approx(0.01 * np.sqrt(np.mean(given.fun**2)))
    assert found.iterations == 7


def test_only_a_search_that_is_cut_short_is_not_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    runs = [made(1.5, seconds=99.0), made(1.5, 0.0)]
    answering(monkeypatch, answer(20, status=0))
    with pytest.warns(ConvergenceWarning, match="before it settled"):
        with_table(TABLE, runs)
    answering(monkeypatch, answer(20, status=1))  # by the slope, a settled one
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with_table(TABLE, runs)


def test_contract_acts_where_it_did_on_a_table_that_begins_above_nought(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The table reaches from 1 to 5 mm, so 4.5 mm is within it."""
    answering(monkeypatch, answer(20))
    raised = FodTable(TABLE.lo, TABLE.step, TABLE.values, 1.0)
    found = with_table(
        raised, [switching(4.5, 4.4), recorded(np.ones(20) * 1.5, np.zeros(20), 0.01)]
    )
    assert (found.model.wires.cut_on, found.model.wires.cut_off) == pytest.approx((4.5, 4.4))
    found = with_table(
        raised, [switching(5.5, 5.4), recorded(np.ones(20) * 1.5, np.zeros(20), 0.01)]
    )
    assert (found.model.wires.cut_on, found.model.wires.cut_off) == pytest.approx((4.998, 4.898))


def test_parameters_at_their_bounds_are_named_and_have_no_error() -> None:
    rows = [Parameter("c1", 1.0, 0.1, 50.0, True), Parameter("latent", 9.0, 0.0, 80.0)]
    rows.append(Parameter("heat 1.5 V", 60.0, 0.0, 2000.0))
    slopes = np.random.default_rng(0).normal(size=(300, 3))

    def judged(*z: float) -> dict[str, float]:
        end = Answer(np.array(z), slopes[:, 0] - 0.5, slopes, 1.0, 1, 7)
        within = np.array([6.0, 80.0, 60.0])
        return wire.errors(
            rows, end, lambda z: by_parameter(rows, z), np.arange(0, 301, 10), within
        )

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert all(np.isfinite(v) for v in judged(1.0, 9.0, 1.5).values())
    # A thousandth of 60 K is near, of 2000 K it would be too much.
    said = r"c1 at most 50, latent at least 0, heat 1\.5 V at least 0, a bound of the search"
    with pytest.warns(DataWarning, match=said):
        found = judged(math.log(50.0) - 1e-9, 1e-9, 0.05)
    assert all(math.isnan(v) for v in found.values())


def test_search_values_are_logarithms_of_times() -> None:
    rows = parameters_of(means(TABLE, [made(1.5), made(1.6)], 25.0))
    values = dict(zip((p.name for p in rows), TRUTH.tolist(), strict=True))
    z = search_values(rows, values)
    assert z[[0, 2, 4]] == pytest.approx(np.log(TRUTH[[0, 2, 4]])) and z[7] == TRUTH[7]
    assert by_parameter(rows, z) == pytest.approx(values, rel=1e-12)
