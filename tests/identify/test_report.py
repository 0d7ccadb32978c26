"""What all kinds have in their report: validation records, figures, notes for other programs."""

from __future__ import annotations

import math
import warnings

import numpy as np
import pytest
from tests.identify.kinds.seen import plots

from macromicro.identify import _report
from macromicro.identify._report import Curves, Pair
from macromicro.identify.notices import DataWarning
from macromicro.identify.result import Line, Result

T = np.arange(40) * 0.5


def made(tests: list[Pair], curves: Curves | None) -> Result:
    parts = Result("hall", "a", None, [Line("mass", 2.0)], [], "", lambda: {"own": "figure"})  # type: ignore[dict-item,return-value]
    return _report.complete(parts, "mm", tests, None if curves is None else lambda: curves)


def test_validation_records_become_lines_data_and_curves() -> None:
    fitted = Curves([Pair("", T, np.sin(T), np.cos(T))] * 2, "y [mm]", 0.5)
    test = Pair("folder/b.csv", T, np.sin(T), np.sin(T) + 0.1)
    found = made([test], fitted)
    assert [x.name for x in found.lines] == ["mass", "test"]
    percent = 100.0 * (1.0 - 0.1 / np.std(np.sin(T)))
    assert abs(found.lines[1].value - percent) < 1e-9
    assert found.lines[1].note == "free run, not fitted: RMS 0.1 mm over 40 samples of b.csv"
    (said,) = found.data["tests"]
    assert (said["file"], said["samples"]) == ("folder/b.csv", 40)
    assert math.isclose(said["fit_percent"], percent) and math.isclose(said["rms"], 0.1)
    drawn = found.plot()
    assert list(drawn) == ["free_run", "residuals", "own"]
    titles = [p.title for p in plots(drawn["free_run"])[:3]]
    assert titles == ["fitted, 1 of 2", "fitted, 2 of 2", "not fitted: b.csv"]
    rest = plots(drawn["residuals"])[0]
    np.testing.assert_allclose(rest.lines[0][2], np.tile(np.sin(T) - np.cos(T), 2))
    assert rest.y == "y [mm]" and rest.lines[0][1][1] == 0.5
    two = made([test, test], fitted)
    assert [x.name for x in two.lines[1:]] == ["test 1", "test 2"]
    assert list(made([test], None).plot()) == ["own"]


def test_a_kind_may_give_residuals_and_tests_of_its_own() -> None:
    own = Curves([Pair("", T, T, T)], "x [mm]", 1.0, [np.ones(40)], "v [mm/s]")
    rest = plots(made([], own).plot()["residuals"])[0]
    assert rest.y == "v [mm/s]" and rest.lines[0][2].tolist() == [1.0] * 40
    parts = Result("deadzone", "a", None, [], [], "", dict, {"tests": [{"right": 3}]})
    assert _report.complete(parts).data["tests"] == [{"right": 3}]


def test_a_record_without_samples_or_a_change_has_no_percentage() -> None:
    none = np.zeros(0)
    assert math.isnan(Pair("a", none, none, none).rms)
    assert math.isnan(Pair("a", T, np.ones(40), np.ones(40)).percent)


def test_parameters_whose_error_exceeds_them_are_named() -> None:
    lines = [Line("mass", 2.0, 1.9), Line("stribeck", -0.1, 0.2), Line("offset", 0.0, 1.0)]
    with pytest.warns(DataWarning, match="^stribeck: not determined") as seen:
        _report.warn_of_undetermined(lines, ("mass", "stribeck"))
    assert len(seen) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        _report.warn_of_undetermined([*lines[::2], Line("stribeck", 0.1)], ("mass", "stribeck"))


def test_notes_hold_each_parameter_with_its_unit_and_accuracy() -> None:
    lines = [
        Line("heating, 10 %", 2.0, 0.25, "K"),
        Line("at 1.5", 3.0, unit="V", extra=0.5, extra_name="step"),
        Line("bare", 1.0),
        Line("test 1", 99.0),
        Line("tested", 4.0),
    ]
    assert _report.notes(lines) == {
        "heating_10": (2.0, "K, +- 0.25"),
        "at_1_5": (3.0, "V, step 0.5"),
        "bare": (1.0, ""),
        "tested": (4.0, ""),
    }
    assert list(_report.notes(lines[1:2], point="p")) == ["at_1p5"]
