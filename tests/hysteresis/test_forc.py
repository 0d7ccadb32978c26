"""Measured first-order reversal curves in the MicroMag format (examples/data/forc)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.files.reading import is_forc
from macromicro.hysteresis import FodTable, Preisach
from macromicro.hysteresis.forc import CutFileWarning, ForcFile, _without_drift, read_forc

DATA = Path(__file__).parents[2] / "examples/data/forc/hchb_forc"


@pytest.fixture(scope="module")
def measured() -> ForcFile:
    return read_forc(DATA)


def moment_range(file: ForcFile) -> float:
    return float(np.ptp(np.concatenate([f for _, f in file.curves])))


def test_reads_all_of_the_file(measured: ForcFile) -> None:
    assert len(measured.curves) == 152
    assert sum(u.size for u, _ in measured.curves) == 30_476
    assert measured.calibration.shape == (152, 2)
    assert measured.calibration[0].tolist() == [6808.018, 0.001282651]
    assert measured.curves[0][0][:2].tolist() == [1140.678, 1174.292]
    assert measured.curves[-1][1][-1] == 1.254075e-3
    assert measured.settings["Units of measure"] == "cgs"
    assert measured.settings["HCal"] == "+6.804196E+03"
    assert "Delaware" not in measured.settings


@pytest.mark.parametrize(("every", "percent", "first"), [(2, 0.06, 0), (4, 0.13, 1), (8, 0.40, 0)])
@pytest.mark.parametrize("shape", ["free", "monotone"])
def test_some_curves_predict_the_others(
    measured: ForcFile, every: int, percent: float, first: int, shape: Any
) -> None:
    """RMS over all points of the unused curves, in percent of the moment's range."""
    curves = measured.curves
    used = range(first, len(curves), every)
    table = FodTable.from_curves([curves[k] for k in used], "ascending", shape=shape)
    unused = [curve for k, curve in enumerate(curves) if k not in used]
    misfit = table.misfit(unused)
    assert misfit.points == sum(u.size for u, _ in unused)
    assert 100.0 * misfit.rms / moment_range(measured) < percent


def test_the_model_runs_through_a_measured_curve(measured: ForcFile) -> None:
    """From positive saturation down to the reversal field and up again, sample by sample."""
    table = FodTable.from_curves(measured.curves[::2], "ascending")
    model = Preisach(table)
    u, f = measured.curves[75]
    model.reset("positive")
    error = model.run(u) - f
    assert np.sqrt(np.mean(error**2)) < 6e-4 * moment_range(measured)


def test_nonnegative_density_is_a_worse_fit_of_interacting_wires(measured: ForcFile) -> None:
    """These data need negative weights: without them the fit is some times worse."""
    free, bound = (
        FodTable.from_curves(measured.curves[::4], "ascending", shape=shape, nodes=101)
        for shape in ("free", "nonnegative")
    )
    assert free.negative_share > 0.03
    assert bound.negative_share < 1e-12
    whole = moment_range(measured)
    assert 2.0 * free.misfit().rms < bound.misfit().rms < 3e-3 * whole


def test_drift_is_taken_out_by_the_calibrations(measured: ForcFile) -> None:
    plain, level = measured.curves, read_forc(DATA, drift=True).curves
    mean = measured.calibration[:, 1].mean()
    for k in (0, 70, 151):
        gain = mean / measured.calibration[k, 1]
        assert np.allclose(level[k][1], gain * plain[k][1], rtol=1e-12)
        assert np.array_equal(level[k][0], plain[k][0])


SMALL = """MicroMag 2900/3900 Data File (Series 0015)
First-order reversal curves
300 Oe a second
Units of measure:  cgs
01/22/2015  17:35

NCrv           = 2
NData          = {points}

+1.0E+00,+3.0E+00

+0.0E+00,+1.0E+00
+5.0E-01,+1.5E+00
+1.0E+00,+3.0E+00

+1.0E+00,+3.3E+00

-1.0E+00,-1.0E+00
+0.0E+00,+0.5E+00
+1.0E+00,+3.0E+00

MicroMag 2900/3900 Data File ends
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "small.frc"
    path.write_text(text)
    return path


def test_a_small_file(tmp_path: Path) -> None:
    file = read_forc(written(tmp_path, SMALL.format(points=8)))
    assert [u.tolist() for u, _ in file.curves] == [[0.0, 0.5, 1.0], [-1.0, 0.0, 1.0]]
    assert file.settings["NCrv"] == "2"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (SMALL.format(points=8).rsplit("MicroMag", 1)[0], "no closing line"),
        (SMALL.format(points=9), "9 announced"),
    ],
)
def test_a_cut_file_is_read_with_a_warning(tmp_path: Path, text: str, said: str) -> None:
    with pytest.warns(CutFileWarning, match=said):
        assert len(read_forc(written(tmp_path, text)).curves) == 2


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("t,u,f\n0,1,2\n", "line 1"),
        ("", "empty"),
        (SMALL.format(points=8).replace("+5.0E-01,+1.5E+00", "+5.0E-01,warm"), "line 13"),
        (SMALL.format(points=8).replace("+5.0E-01,+1.5E+00", "+5.0E-01"), "line 13"),
        (SMALL.split("+1.0E+00,+3.3E+00", maxsplit=1)[0], "1 of at least 2 curves"),
        (SMALL.split("+1.0E+00", maxsplit=1)[0], "0 of at least 2 curves"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, text: str, named: str) -> None:
    with pytest.raises(InputError, match=named):
        read_forc(written(tmp_path, text))


def test_missing_files_and_missing_calibrations_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_forc(tmp_path / "none.frc")
    without = SMALL.format(points=7).replace("+1.0E+00,+3.3E+00\n", "")
    with pytest.raises(InputError, match="one calibration before each curve"):
        read_forc(written(tmp_path, without), drift=True)


def test_a_calibration_of_nothing_is_refused_and_one_of_one_is_not() -> None:
    """Moments are scaled by the mean calibration over the one before the curve."""
    curve = np.array([3.0, 1.0]), np.array([2.0, 1.0])
    found = _without_drift([curve, curve], np.array([[0.0, 1.0], [5.0, 3.0]]), "here")
    for (u, f), gain in zip(found, (2.0, 2.0 / 3.0), strict=True):
        assert u.tolist() == [3.0, 1.0]
        np.testing.assert_allclose(f, gain * curve[1])
    with pytest.raises(InputError, match="the moment is 0 at calibration 2"):
        _without_drift([curve, curve], np.array([[5.0, 1.0], [5.0, 0.0]]), "here")
    with pytest.raises(InputError, match="number 2 and 1"):
        _without_drift([curve], np.array([[5.0, 1.0], [5.0, 3.0]]), "here")


FIRST = "+1.0E+00,+2.0E+00\n\n+0.9E+00,+1.9E+00\n\n+1.0E+00,+3.0E+00\n"


@pytest.mark.parametrize("cut", [False, True])
def test_a_first_curve_of_one_point_is_no_calibration(tmp_path: Path, cut: bool) -> None:
    """Every second block is one, the first too: so a point between two of them is a curve."""
    text = SMALL.format(points=10).replace("+1.0E+00,+3.0E+00\n", FIRST, 1)
    if cut:  # in the middle of a calibration and its curve
        text = text[: text.index("-1.0E+00,-1.0E+00")].replace("= 10", "= 6")
        with pytest.warns(CutFileWarning):
            file = read_forc(written(tmp_path, text))
        assert [len(u) for u, _ in file.curves] == [1, 3] and len(file.calibration) == 3
        return
    file = read_forc(written(tmp_path, text), drift=True)
    assert [len(u) for u, _ in file.curves] == [1, 3, 3]
    assert file.calibration[:, 1].tolist() == [2.0, 3.0, 3.3]
    mean = (2.0 + 3.0 + 3.3) / 3.0
    for (_, f), end in zip(file.curves, (1.9 / 2.0, 3.0 / 3.0, 3.0 / 3.3), strict=True):
        assert f[-1] == pytest.approx(mean * end)


SEGMENTS = """MicroMag 2900/3900 Data File (Series 0016.002)
Direct moment vs. field; First-order reversal curves

INSTRUMENT
Configuration                    VSM
Units of measure                 SiMuNaughtH
 01/22/2015 17:35

SCRIPT
Includes loop?                   No
HCal                            +1.000000E+00
Number of segments               4
Number of data                   9

             Averaging   Initial     Field      Final      Pause    Final
Segment        Time       Field    Increment    Field                Index
Number         (s)         (T)       (T)         (T)         (s)

  0,+500.0E-03,+1.000E+00,+0.000E+00,+1.000E+00,+0.000E+00,     1
  1,+500.0E-03,+0.000E+00,+500.0E-03,+1.000E+00,+1.000E+00,     4
  2,+500.0E-03,+1.000E+00,+0.000E+00,+1.000E+00,+0.000E+00,     5
  3,+500.0E-03,-1.000E+00,+250.0E-03,+1.000E+00,+1.000E+00,     9

    Field       Moment     Temperature
     (T)        (Am²)         (K)

+1.0E+00,+3.0E+00,+293.1E+00
{gap}+0.0E+00,+1.0E+00,+293.1E+00
+5.0E-01,+1.5E+00,+293.1E+00
+1.0E+00,+3.0E+00,+293.1E+00
{gap}+1.0E+00,+3.3E+00,+293.1E+00
{gap}-1.0E+00,-1.0E+00,+293.1E+00
+2.0E-01,+0.5E+00,+293.1E+00
+2.5E-01,+0.6E+00,+293.1E+00
+1.0E+00,+3.0E+00,+293.1E+00

MicroMag 2900/3900 Data File ends
"""


@pytest.mark.parametrize("gap", ["\n", ""])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_a_table_of_segments_and_irregular_steps(tmp_path: Path, gap: str, encoding: str) -> None:
    """Series 16: settings in columns, a third column, segments by their last index or by lines."""
    path = tmp_path / "small.frc"
    path.write_text(SEGMENTS.format(gap=gap), encoding=encoding)
    assert is_forc(path)
    file = read_forc(path, drift=True)
    assert [u.tolist() for u, _ in file.curves] == [[0.0, 0.5, 1.0], [-1.0, 0.2, 0.25, 1.0]]
    assert file.calibration.tolist() == [[1.0, 3.0], [1.0, 3.3]]
    assert file.settings["Units of measure"] == "SiMuNaughtH"
    assert file.settings["Number of data"] == "9"


def test_calibrations_without_empty_lines(tmp_path: Path) -> None:
    """A point far above the rest of its block is none of its curve."""
    text = SMALL.format(points=8)
    text = text.replace("+3.0E+00\n\n+0.0", "+3.0E+00\n+0.0").replace("+3.3E+00\n\n", "+3.3E+00\n")
    file = read_forc(written(tmp_path, text.replace(",", " , ")))
    assert [u.tolist() for u, _ in file.curves] == [[0.0, 0.5, 1.0], [-1.0, 0.0, 1.0]]
    assert file.calibration[:, 1].tolist() == [3.0, 3.3]


@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_curves_of_one_block_begin_where_the_field_falls(tmp_path: Path, mark: str) -> None:
    """Without empty lines, calibrations or a table."""
    starts, rows = (-0.2, -0.5, -0.9), []
    for start in starts:
        rows += [f"{u:.3f}{mark}{u - start:.4f}" for u in np.arange(start, 1.0, 0.05)]
    ends = "\nMicroMag Data File ends\n"
    file = read_forc(written(tmp_path, "MicroMag made\n\n" + "\n".join(rows) + ends))
    assert [u[0] for u, _ in file.curves] == list(starts)
    assert sum(len(u) for u, _ in file.curves) == len(rows) and not len(file.calibration)
