"""`identify linear` on data of a known model: lines, remarks, text and figures."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, plots, table

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.kinds import linear
from macromicro.identify.kinds.linear import Options
from macromicro.identify.linear import LinearFit, Whiteness
from macromicro.identify.picking import Picked
from macromicro.identify.runs import Run

DT, N = 0.02, 300
T = np.arange(N) * DT


def excited(seed: int = 1) -> Array:
    return np.repeat(np.random.default_rng(seed).uniform(-5.0, 5.0, N // 10), 10)


def answered(u: Array, a: float = -0.9, b: float = 0.5, delay: int = 1) -> Array:
    y = np.zeros(len(u))
    for k in range(1, len(u)):
        y[k] = -a * y[k - 1] + (b * u[k - delay] if k >= delay else 0.0)
    return y + 1e-3 * np.random.default_rng(9).standard_normal(len(u))


def test_what_would_foretell_the_records_better_is_said(tmp_path: Path) -> None:
    u = excited()
    y = answered(u, delay=4)
    file = table(tmp_path / "a.csv", "t_s,u_V,y_mm", T, u, y)
    said = dict(linear.identify(given(file), Options()).remarks)
    text = said["lower error on the last 30 %, by a fit to the rest"]
    assert text.startswith("a delay of 4 (--order 1,1,4), by 100 %; ") and text.endswith(" %")
    right = dict(linear.identify(given(file), Options(order="1,1,4")).remarks)
    assert not any("lower error" in name for name in right)


def test_a_first_order_model_and_all_that_is_said_of_it(tmp_path: Path) -> None:
    u = excited()
    y = answered(u)
    found = linear.identify(given(table(tmp_path / "a.csv", "t_s,u_V,y_mm", T, u, y)), Options())
    fit = found.model
    lines = facts(found.lines)
    assert list(lines) == ["a1", "b1", "gain", "pole"]
    assert lines["a1"].value == pytest.approx(-0.9, abs=1e-3) and lines["a1"].unit == ""
    assert lines["b1"].value == pytest.approx(0.5, abs=1e-3) and lines["b1"].unit == "mm/V"
    assert lines["gain"].value == pytest.approx(5.0, abs=0.01)
    assert lines["gain"][2:5] == (fit.gain_std, "mm/V", "at standstill")
    assert (lines["a1"].error, lines["b1"].error) == tuple(fit.std)
    pole = math.log(-fit.a[0]) / DT
    assert lines["pole"].value == pytest.approx(pole)
    assert lines["pole"].error == pytest.approx(fit.std[0] / abs(fit.a[0]) / DT)
    assert lines["pole"][3:5] == ("rad/s", f"time constant {-1.0 / pole:.4g} s")
    said = dict(found.remarks)
    ends = "ends of the search, by starting point"
    assert list(said) == ["fit", "residuals", "method", ends]
    reached = [f"{name} {fit.fit:.2f} %" for name in ("mls", "sriv", "least_squares")]
    assert said[ends] == ", ".join(reached) + "; the best is taken"
    assert said["fit"] == f"free run {fit.fit:.2f} %, 300 samples of 0.02 s"
    words = "white" if fit.whiteness.white else "not white"
    assert said["residuals"] == f"{words} (p = {fit.whiteness.p_value:.2g})"
    assert said["method"] == f"{fit.method}, {fit.iterations} iterations, start at rest"
    assert found.title == "y = (b1 z^-1 + b2 z^-2 + ...) / (1 + a1 z^-1 + ...) u"
    toml = tomllib.loads(found.toml)["linear"]
    assert toml["a"] == pytest.approx(list(fit.a)) and toml["b"] == pytest.approx(list(fit.b))
    assert (toml["delay"], toml["dt"], toml["method"]) == (1, DT, fit.method)
    assert "# Not for `macromicro run --config`: the bench is not a linear model.\n" in found.toml
    assert "# mm per V" in found.toml and "# samples from u to y" in found.toml
    assert f"# free-run fit {fit.fit:.2f} %" in found.toml
    assert found.data["gain"] == fit.gain and found.data["fit_percent"] == fit.fit
    assert found.data["delay"] == 1 and found.data["white"] == fit.whiteness.white
    shown = found.plot()
    run = plots(shown["free_run"])
    assert run[0].y == "output [mm]"
    np.testing.assert_allclose(run[0].lines[0][1], T)
    np.testing.assert_allclose(run[0].lines[0][2], y, atol=1e-12)
    np.testing.assert_allclose(run[0].lines[1][2], fit.free_run[0])
    rest = plots(shown["residuals"])
    assert rest[0].y == "output [mm]"
    np.testing.assert_allclose(rest[0].lines[0][1][:3], [0.0, DT, 2.0 * DT])


def test_positions_are_differentiated_and_shown_as_positions(tmp_path: Path) -> None:
    u = excited()
    x = np.cumsum(answered(np.sign(u) * np.maximum(np.abs(u) - 0.5, 0.0))) * DT
    one, two = (table(tmp_path / f"{n}.csv", "t_s,u_V,x_mm", T, u, x) for n in "ab")
    found = linear.identify(given(one, two), Options(width=0.5))
    said = dict(found.remarks)
    assert said["records"] == "2 with the same input, averaged"
    assert said["dead zone"] == "0.5 V subtracted from the input"
    assert said["output"].startswith("speed: the position differentiated; its own fit ")
    lines = facts(found.lines)
    assert lines["b1"].unit == "mm/s/V"
    run = plots(found.plot()["free_run"])
    assert run[0].y == "position from the start [mm]"
    assert plots(found.plot()["residuals"])[0].y == "output [mm/s]"
    travel = run[0].lines[0][2]
    assert travel[-1] - travel[0] == pytest.approx(x[-1] - x[0], abs=0.5)
    fitted_to = run[0].lines[1][2]
    np.testing.assert_allclose(fitted_to, np.cumsum(found.model.free_run[0]) * DT)


def test_outputs_of_two_files_are_fitted_together_with_a_delay(tmp_path: Path) -> None:
    files = []
    for k in (1, 2):
        u = excited(k)
        y = answered(u, delay=3)
        files.append(table(tmp_path / f"{k}.csv", "t_s,u,y", T, u, y))
    found = linear.identify(given(*files), Options(order="1,1,3", start="free"))
    assert dict(found.remarks)["records"] == "2, fitted together"
    assert dict(found.remarks)["method"].endswith("start at free")
    assert dict(found.remarks)["fit"].endswith("600 samples of 0.02 s")
    assert found.title.endswith(" u, 2 samples later")
    assert facts(found.lines)["b1"].unit == ""
    assert facts(found.lines)["b1"].value == pytest.approx(0.5, abs=0.01)
    assert found.data["delay"] == 3
    sooner = linear.identify(given(*files), Options(order="1,1,2"))
    assert sooner.title.endswith(" u, 1 samples later")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (Options(method="x"), "--method: 'x'; accepted: output_error, box_jenkins, mls, sriv, gls"),
        (Options(start="x"), "--start: 'x'; accepted: rest or free"),
        (Options(order="1"), "--order: '1'; accepted: na,nb or na,nb,delay, such as 1,1"),
        (Options(order="1,2,3,4"), "--order"),
        (Options(order="a,b"), "--order: 'a,b'"),
    ],
)
def test_options_are_checked(options: Options, message: str) -> None:
    with pytest.raises(InputError, match=message):
        linear.identify(given(), options)


def test_orders_and_defaults() -> None:
    assert linear.order("2,1") == (2, 1, 1)
    assert linear.order("2,1,3") == (2, 1, 3)
    assert Options() == ("output_error", "1,1,1", "rest", 0.0, None, ())


def test_files_of_two_sample_times_are_refused(tmp_path: Path) -> None:
    u = excited()
    y = answered(u)
    for factor, fails in ((1.0005, False), (1.002, True), (0.99, True)):
        files = [table(tmp_path / f"{k}.csv", "t_s,u,y", T * k, u, y) for k in (1.0, factor)]
        if not fails:
            assert linear.identify(given(*files), Options()).data["dt"] == pytest.approx(DT)
            continue
        with pytest.raises(InputError, match=r"records: the sample times are \[.*one sample time"):
            linear.identify(given(*files), Options())


def test_the_dead_zone_is_taken_off_the_size_of_the_input() -> None:
    u = np.tile([3.0, -3.0, 0.5, -0.5, 0.0], 10)
    values = {"t": np.arange(50.0), "u": u, "x": np.arange(50.0), "y": u**2}
    found = linear.sampled_runs([Picked("f", values, {}, {}, {})], 1.0)
    np.testing.assert_array_equal(found[0].u[:5], [2.0, -2.0, 0.0, 0.0, 0.0])
    np.testing.assert_array_equal(found[0].x[:2], [9.0, 9.0])
    del values["y"]
    assert linear.sampled_runs([Picked("f", values, {}, {}, {})], 1.0)[0].x[1] == 1.0
    del values["x"]
    with pytest.raises(
        InputError, match=r"f: there is neither an output y nor a position x.*--columns y="
    ):
        linear.sampled_runs([Picked("f", values, {}, {}, {})], 1.0)


def test_positions_under_one_input_are_averaged_in_both_directions() -> None:
    t = np.arange(30.0)
    u = np.sin(t)
    runs = [Run(t, u, t), Run(t, -u, -3.0 * t), Run(t, 2.0 * u, t), Run(t[:9], u[:9], t[:9])]
    made, said = linear.average_positions(runs, True)
    assert said == ["2 with the same input, 1 with the same input, 1 with the same input, averaged"]
    np.testing.assert_allclose(np.diff(made[0].x), 2.0)
    assert [len(r.t) for r in made] == [30, 30, 9]
    assert linear.average_positions(runs[1:], True)[1] == ["fitted together"]
    assert linear.average_positions(runs[:2], False) == (runs[:2], ["2, fitted together"])
    assert linear.average_positions(runs[:1], True) == (runs[:1], [])


def fit(a: list[float], b: list[float]) -> LinearFit:
    n = len(a) + len(b)
    white = Whiteness(np.zeros(1), 0.0, 1.0, True)
    cov = np.diag(np.arange(1.0, n + 1) ** 2 * 1e-4)
    return LinearFit("m", np.array(a), np.array(b), 0.1, 1, cov, (), (), 99.0, white)


def test_lines_tell_the_coverage_factors_of_few_stretches() -> None:
    shares = np.broadcast_to(np.eye(2), (4, 2, 2))
    lines = linear.coefficients(replace(fit([-0.9], [2.0]), shares=shares), "m", "V")
    assert [x.name for x in lines] == ["a1", "b1", "gain", "pole"]
    assert [x.factor for x in lines] == pytest.approx([2.776] * 4, abs=0.01)
    assert [x.factor for x in linear.coefficients(fit([-0.9], [2.0]), "m", "V")] == [1.96] * 4


def scattered(a: list[float], what: Callable[[Array], Array]) -> Array:
    """How a property of the poles at 0.1 s scatters as a does, by the errors of `fit`."""
    random, made = np.random.default_rng(4), []
    for _ in range(4000):  # at a hundredth of the errors, where poles are linear in a
        moved = np.array(a) + 1e-4 * np.array([1.0, 2.0]) * random.standard_normal(2)
        made.append(what(np.log(np.roots(np.r_[1.0, moved]).astype(complex)) / 0.1))
    return 100.0 * np.std(made, axis=0)


def test_lines_of_second_order_models() -> None:
    # Poles 0.8 and 0.5 at 0.1 s, and a pair.
    lines = linear.coefficients(fit([-1.3, 0.4], [1.0, 2.0]), "m", "V")
    assert [x.name for x in lines] == ["a1", "a2", "b1", "b2", "gain", "pole 1", "pole 2"]
    np.testing.assert_allclose([x.error for x in lines[:4]], [0.01, 0.02, 0.03, 0.04])
    poles = sorted(x.value for x in lines[5:])
    assert poles == pytest.approx([10 * math.log(0.5), 10 * math.log(0.8)])
    np.testing.assert_allclose(
        [x.error for x in lines[5:]], scattered([-1.3, 0.4], lambda s: s.real), rtol=0.05
    )
    r, angle = 0.9, 0.3
    pair = linear.coefficients(fit([-2 * r * math.cos(angle), r * r], [1.0]), "m", "m")
    assert len(pair) == 5 and pair[2].unit == pair[3].unit == ""
    size = 10 * math.hypot(math.log(r), angle)
    assert pair[4].value == pytest.approx(size)
    a = [-2 * r * math.cos(angle), r * r]
    assert pair[4].error == pytest.approx(scattered(a, np.abs)[0], rel=0.05)
    own = scattered(a, lambda s: -s.real / np.abs(s))[0]
    found = re.fullmatch(r"a pair, damping (\S+) \+- (\S+)", pair[4].note)
    assert found is not None
    assert float(found[1]) == pytest.approx(-10 * math.log(r) / size, abs=own)
    assert float(found[2]) == pytest.approx(own, rel=0.06)
    unsure = replace(fit(a, [1.0]), covariance=np.full((3, 3), math.nan))
    told = linear.coefficients(unsure, "m", "m")[4]
    assert math.isnan(told.error) and "+-" not in told.note
    slow = linear.coefficients(fit([-2 * r * math.cos(0.05), r * r], [1.0]), "m", "m")
    assert len(slow) == 5 and slow[4].value == pytest.approx(10 * math.hypot(math.log(r), 0.05))
    assert linear.coefficients(fit([-1.1], [1.0]), "m", "V")[3].note == "unstable"
