"""`identify hysteresis` of recordings over time: how far from any model, and predicted."""

from __future__ import annotations

import itertools
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, table

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import FodTable, Preisach, congruency, wiping_out
from macromicro.hysteresis.table_files import load_table, save_table
from macromicro.identify import _report
from macromicro.identify.kinds import hysteresis
from macromicro.identify.kinds.hysteresis import Found, Options
from macromicro.identify.notices import DataWarning


def legs(*corners: float, n: int = 20) -> Array:
    parts = [np.linspace(a, b, n + 1)[1:] for a, b in itertools.pairwise(corners)]
    return np.r_[corners[0], np.concatenate(parts)]


def test_a_record_shows_how_far_it_is_from_any_preisach_model() -> None:
    u = legs(0, 10, 2, 8, 2, 8, 0, 10, 4, 8, 2, n=60)
    # The output creeps, and the input turns back by a hundredth of its range: that is noise.
    u = u + 0.25 * (np.arange(len(u)) % 4 == 1)
    f = u + 0.02 * np.arange(len(u)) + 0.3 * np.sqrt(np.abs(u))
    found = hysteresis._broken(Found([], "descending", [(u, f), (u, 2.0 * f)]))
    swing = 0.03 * float(np.ptp(u))
    for line, check in zip(found, (wiping_out, congruency), strict=True):
        gap = check(u, f, swing)
        assert gap.rms > 0.001
        assert line.value == pytest.approx(100.0 * gap.rms) and line.unit == "% of range"
        assert line.note == f"RMS of {len(gap.gaps)} comparisons; 0 for a Preisach model"
    assert [x.name for x in found] == ["wiping-out", "congruency"]
    assert hysteresis._broken(Found([], "descending", [])) == []
    ramp = legs(0, 10, 0)
    assert hysteresis._broken(Found([], "descending", [(ramp, ramp)])) == []


def test_a_recording_over_time_says_how_far_it_is_from_the_model(tmp_path: Path) -> None:
    corners = [c for top in (12, 14, 16, 18, 20) for c in (10, top)]
    u = legs(*corners, 10, 15, 12, 15, 10)
    f = (u - 10.0) ** 1.5
    file = table(tmp_path / "a.csv", "t_s,u_V,f_mm", np.arange(len(u)), u, f)
    lines = facts(hysteresis.identify(given(file), Options()).lines)
    assert lines["wiping-out"].value == pytest.approx(0.0, abs=0.01)


N = 11
TABLE = FodTable(
    0.0, 1.0, 4.0 * np.tril(np.subtract.outer(np.arange(N), np.arange(N)) / 10.0) ** 2, 2.0
)


def said(folder: Path, u: Array, f: Array) -> str:
    file = table(folder / "test.csv", "u,f", u, f)
    one, how = hysteresis._predict(TABLE, str(file), {}, {})
    name, text = _report.of_range(one, abs(TABLE.span), how)
    assert name == f"prediction of {file}"
    return text


def test_a_recording_is_predicted_from_its_first_point(tmp_path: Path) -> None:
    u = legs(5.0, 8.0, 2.0, 9.0, n=30)
    model = Preisach(TABLE)
    start = 3.2  # between both branches at 5
    model.initialise_at(5.0, start)
    f = model.run(u)
    assert f[0] == pytest.approx(start)
    assert (
        said(tmp_path, u, f)
        == f"RMS 0.00 % of range, over {len(u)} samples, from its first point on"
    )
    off = np.r_[0.0, 0.4 * (-1.0) ** np.arange(len(u) - 1)]  # a tenth of the range
    assert (
        said(tmp_path, u, f + off)
        == f"RMS 9.94 % of range, over {len(u)} samples, from its first point on"
    )
    # A second point that the first one does not lead to.
    jump = np.r_[5.0, 9.0, u[2:]]
    model.initialise_at(5.0, start)
    assert said(tmp_path, jump, model.run(jump)).startswith("RMS 0.00 % of range, over 91 samples")
    # Below both branches there is no state: from negative saturation.
    model.reset("negative")
    f = model.run(u)
    assert said(tmp_path, u, np.r_[-9.0, f[1:]]).endswith("from negative saturation on")
    assert said(tmp_path, u, np.r_[f[0] - 1.0, f[1:]]) == (
        "RMS 2.62 % of range, over 91 samples, from negative saturation on"
    )


def test_inputs_beyond_the_table_are_told_from_one_in_a_hundred_on(tmp_path: Path) -> None:
    u = legs(0.0, 10.0, 0.0, n=100)  # 201 samples
    with warnings.catch_warnings():
        warnings.simplefilter("error", DataWarning)
        said(tmp_path, np.r_[11.0, -1.0, u[2:]], 0.1 * u + 2.0)
    for beyond in (11.0, -1.0):
        with pytest.warns(DataWarning, match=r"3 of 201 inputs beyond the table's 0 to 10; taken"):
            said(tmp_path, np.r_[[beyond] * 3, u[3:]], 0.1 * u + 2.0)


@pytest.mark.parametrize("name", ["table.h5", "table.csv"])
def test_a_saved_table_predicts_a_recording(tmp_path: Path, name: str) -> None:
    """Without a fit, and in a folder of its own."""
    save_table(replace(TABLE, input_unit="V", output_unit="mm"), tmp_path / name)
    u = legs(0.0, 8.0, 2.0, 9.0, n=30)
    test = table(tmp_path / "test.csv", "u_V,f_mm", u, Preisach(TABLE).run(u))
    options = Options(tests=(str(test),))
    found = hysteresis.identify(given(tmp_path / name), options)
    assert dict(found.remarks)[f"prediction of {test}"].startswith("RMS 0.00 % of range")
    line = facts(found.lines)["output, high"]
    assert line.value == pytest.approx(6.0) and line.unit == "mm"
    found.save(tmp_path / "out")
    again = load_table(tmp_path / "out" / name)
    np.testing.assert_allclose(again.values, TABLE.values)
    assert (again.input_unit, again.output_unit) == ("V", "mm")
    other = table(tmp_path / "other.csv", "u_V,f_um", u, Preisach(TABLE).run(u))
    with pytest.raises(InputError, match=r"f is in um, in the table in mm"):
        hysteresis.identify(given(tmp_path / name), Options(tests=(str(other),)))
    with pytest.raises(InputError, match=r"a table, not a recording. Name a recording to predict"):
        hysteresis.identify(given(tmp_path / name), Options())


def test_numbered_cycles_are_cut_as_the_same_rows_without_numbers(tmp_path: Path) -> None:
    """The last of them may be cut off."""
    tops = (4.0, 6.0, 8.0, 10.0)
    cycles = [legs(0.0, top, 0.0, n=30)[1:] for top in tops]
    cycles[-1] = cycles[-1][:-8]
    u, number = np.concatenate(cycles), np.repeat(range(4), [len(cycle) for cycle in cycles])
    f = Preisach(TABLE).run(u)
    files = [
        table(tmp_path / "a.csv", "u,f", u, f),
        table(tmp_path / "b.csv", "u,f,curve", u, f, number),
    ]
    plain, numbered = (hysteresis.identify(given(file), Options()) for file in files)
    np.testing.assert_array_equal(numbered.model.values, plain.model.values)
    tested = hysteresis.identify(given(files[0]), Options(tests=(str(files[1]),)))
    rms = 100.0 * plain.model.misfit().rms / abs(plain.model.span)
    (said,) = (text for name, text in tested.remarks if name.startswith("prediction of"))
    assert said.startswith(f"RMS {rms:.2f} % of range")
    assert said.endswith("4 curves, each from its saturation")
