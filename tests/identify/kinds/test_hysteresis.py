"""`identify hysteresis` on curves of equal relays, which are parabolas."""

from __future__ import annotations

import math
import re
import tomllib
import warnings
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from tests.identify.kinds.seen import facts, given, plots, table

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import FodTable, forc, from_density, table_files
from macromicro.hysteresis.shape import ROUGH, ROUNDS
from macromicro.hysteresis.table import Misfit
from macromicro.identify.kinds import hysteresis
from macromicro.identify.kinds.hysteresis import Errors, Options
from macromicro.identify.notices import DataWarning

LOW, HIGH = 10.0, 20.0  # V
Pairs = list[tuple[Array, Array]]


def relays(tops: Array, scale: float = 4.0, n: int = 41) -> Pairs:
    """Falls from some maxima: as many relays everywhere; 2 mm at the low end, 2 + `scale` above."""
    found = []
    for top in tops:
        u = np.linspace(top, LOW, n)
        weight = (top - LOW) ** 2 - (top - u) ** 2
        found.append((u, 2.0 + scale * weight / (HIGH - LOW) ** 2))
    return found


def written(place: Path, pairs: Pairs, head: str = "curve,u_V,f_mm") -> Path:
    number = np.repeat(np.arange(len(pairs)), [len(u) for u, _ in pairs])
    return table(place, head, number, *(np.concatenate([p[k] for p in pairs]) for k in (0, 1)))


TOPS = np.linspace(11.0, 20.0, 10)


def test_saturations_misfit_and_prediction(tmp_path: Path) -> None:
    scale = -4.0
    pairs = relays(TOPS, scale)
    test = table(tmp_path / "b.csv", "u_V,f_mm", *pairs[-1])  # it falls from saturation
    options = Options(tests=(str(test),))
    found = hysteresis.identify(given(written(tmp_path / "a.csv", pairs)), options)
    lines = facts(found.lines)
    assert list(lines) == [
        "input, from", "input, to", "output, low", "output, high", "misfit", "prediction",
        "negative weight", "test",
    ]  # fmt: skip
    assert lines["test"].value > 99.0
    made = found.model
    own = made.misfit().rms
    assert 0.0 < own < 0.02
    assert lines["input, from"][1:4:2] == (10.0, "V") and lines["input, to"].value == 20.0
    assert lines["output, low"].value == pytest.approx(2.0, abs=0.01)
    assert lines["output, high"].value == pytest.approx(2.0 + scale, abs=0.02)
    for name in ("output, low", "output, high"):
        assert (lines[name].extra, lines[name].extra_name, lines[name].unit) == (
            own,
            "misfit",
            "mm",
        )
        assert math.isnan(lines[name].error)
    assert lines["misfit"].value == pytest.approx(100.0 * own / 4.0, rel=0.01)
    held = found.data["holdout_rms"]
    assert 0.0 < held < 0.05 and held != own
    assert lines["prediction"].value == pytest.approx(100.0 * held / 4.0, rel=0.01)
    assert lines["negative weight"].value == round(100.0 * made.negative_share, 6)
    assert found.data["range"] == pytest.approx(4.0, abs=0.02)
    assert found.data["misfit"]["rms"] == own
    said = dict(found.remarks)
    assert said["curves"] == "10 descending, 410 points"
    assert said[f"prediction of {test}"].endswith(
        "of range, over 41 samples, from its first point on"
    )
    content = tomllib.loads(found.toml)["hysteresis"]
    assert content["input"] == [10.0, 20.0] and content["table"] == "table.h5"
    assert content["output"] == pytest.approx([2.0, 2.0 + scale], abs=0.02)
    assert found.toml.startswith(
        "# No setting of `macromicro run --config` holds a table of first-order curves.\n"
        "# Read it with macromicro.hysteresis.table_files.load_table, or the CSV with anything.\n"
    )
    assert "input = [10.0, 20.0]  # V\n" in found.toml and "]  # mm\n" in found.toml
    for name in (hysteresis.TABLE, hysteresis.SHEET):
        found.extra[name](tmp_path / name)
    again = table_files.load_table(tmp_path / hysteresis.TABLE)
    np.testing.assert_array_equal(again.values, made.values)
    assert (tmp_path / hysteresis.SHEET).read_text()


def test_few_curves_hold_none_out_and_a_free_density_has_negative_weight(tmp_path: Path) -> None:
    pairs = relays(TOPS[::2])
    random = np.random.default_rng(1)
    pairs = [(u, f + 0.01 * random.standard_normal(len(f))) for u, f in pairs]
    file = written(tmp_path / "a.csv", pairs, "curve,u,f")
    found = hysteresis.identify(given(file), Options(shape="free", smooth=0.5))
    lines = facts(found.lines)
    assert "prediction" not in lines and math.isnan(found.data["holdout_rms"])
    share = 100.0 * found.model.negative_share
    assert share > 1.0 and lines["negative weight"].value == round(share, 6) != share
    assert round(share, 7) != round(share, 6)
    assert found.model.smooth == 0.5 and found.model.shape == "free"
    assert set(found.plot()) == {"curves", "density"}
    assert "# unit of the input\n" in found.toml and "# unit of the output\n" in found.toml
    assert lines["input, to"].unit == lines["output, low"].unit == ""
    assert Options() == ("auto", "monotone", 1.0, "input", False, ())
    with pytest.raises(InputError, match="--shape: 'x'; accepted: free, monotone, nonnegative"):
        hysteresis.identify(given(file), Options(shape="x"))


@pytest.mark.parametrize(("spread", "fails"), [(0.46, True), (0.54, False)])
def test_reversals_spread_over_a_twentieth_of_the_range(
    tmp_path: Path, spread: float, fails: bool
) -> None:
    pairs = relays(np.linspace(20.0 - spread, 20.0, 3))
    file = written(tmp_path / "a.csv", pairs)
    if not fails:
        hysteresis.identify(given(file), Options())
        return
    with pytest.raises(InputError, match=r"a\.csv: all 3 curves reverse at 19\.54: they show"):
        hysteresis.identify(given(file), Options())


class Table(NamedTuple):
    """What `_held_out` asks of a table; it predicts 7 less than the input."""

    kind: str
    starts: list[float]

    def misfit(self, pairs: Pairs) -> Misfit:
        warnings.warn("said before", DataWarning, stacklevel=2)
        return Misfit(0.25, float(len(pairs)), 3)

    def curve(self, start: float, u: Array) -> Array:
        self.starts.append(start)
        return u - 7.0


@pytest.mark.parametrize(
    ("n", "seen", "unseen"),
    [(6, [0, 2, 4, 5], [1, 3]), (7, [0, 2, 4, 6], [1, 3, 5]), (8, [0, 2, 4, 6, 7], [1, 3, 5])],
)
def test_every_second_curve_is_held_out_but_the_last(
    n: int, seen: list[int], unseen: list[int]
) -> None:
    u = np.array([5.0, math.nan, 3.0, 4.0])
    pairs = [(u + k, np.array([1.0, 2.0, math.nan, k])) for k in range(n)]
    for kind, first in (("descending", 5.0), ("ascending", 4.0)):
        got: list[Pairs] = []
        made = Table(kind, [])

        def make(some: Pairs, got: list[Pairs] = got, made: Table = made) -> Any:
            got.append(some)
            return made

        with warnings.catch_warnings():
            warnings.simplefilter("error")
            found = hysteresis._held_out(make, pairs)  # type: ignore[arg-type]
        assert found is not None
        assert [f[3] for _, f in got[0]] == seen
        assert made.starts == [first + k for k in unseen]
        for (uu, f, model), k in zip(found.curves, unseen, strict=True):
            np.testing.assert_array_equal(uu, [5.0 + k, 4.0 + k])
            np.testing.assert_array_equal(f, [1.0, k])
            np.testing.assert_array_equal(model, uu - 7.0)
        assert found[:2] == (0.25, len(unseen))
    assert hysteresis._held_out(make, pairs[:5]) is None  # type: ignore[arg-type]


@pytest.mark.parametrize(("held", "shown"), [(4, 4), (5, 5), (6, 3), (12, 4)])
def test_residuals_of_five_curves_at_most_are_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, held: int, shown: int
) -> None:
    u = np.array([3.0, 2.0])
    curves = [(u + k, u * k, u * k - 0.25) for k in range(held)]
    monkeypatch.setattr(hysteresis, "_held_out", lambda *_: Errors(0.1, 0.2, curves))
    found = hysteresis.identify(given(written(tmp_path / "a.csv", relays(TOPS[::3]))), Options())
    drawn = found.plot()
    assert set(drawn) == {"curves", "density", "residuals"}
    only = plots(drawn["residuals"])[0]
    assert (only.x, only.y) == ("input [V]", "output [mm]")
    assert len(only.lines) == shown
    step = math.ceil(held / 5)
    for k, (label, x, y) in enumerate(only.lines):
        assert label == f"from {3.0 + k * step:.4g}"
        np.testing.assert_array_equal(x, u + k * step)
        np.testing.assert_allclose(y, 0.25)
    assert found.data["holdout_rms"] == 0.1
    assert drawn["curves"].axes[0].get_xlabel() == "input u [V]"


def test_curves_are_sorted_by_the_input_where_they_begin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make(self: object, pairs: Pairs) -> None:
        raise KeyError([u[0] for u, _ in pairs])

    monkeypatch.setattr(hysteresis._Maker, "__call__", make)
    # The second inputs, and the outputs, are in other orders.
    pairs = [
        (np.r_[top, 2.0 * k, 1.0], np.r_[-top, 1.0, 0.0])
        for k, top in enumerate((16.0, 12.0, 20.0, 14.0, 18.0))
    ]
    with pytest.raises(KeyError) as seen:
        hysteresis.identify(given(written(tmp_path / "a.csv", pairs)), Options())
    assert seen.value.args[0] == [12.0, 14.0, 16.0, 18.0, 20.0]


def micromag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, units: str) -> Path:
    """A file that begins as one, whose curves are ascending."""
    place = tmp_path / "forc"
    place.write_text("MicroMag 2900/3900 Data File\n")
    curves = [(30.0 - u, -f) for u, f in relays(TOPS)]
    settings = {"Units of measure": units} if units else {}
    monkeypatch.setattr(
        forc,
        "read_forc",
        lambda file, drift: forc.ForcFile(
            [(u, 2.0 * f) if drift else (u, f) for u, f in curves], np.zeros((0, 2)), settings
        ),
    )
    return place


@pytest.mark.parametrize(
    ("units", "u", "f"), [("Hybrid SI", "T", "A*m^2"), ("CGS", "Oe", "emu"), ("", "T", "A*m^2")]
)
def test_a_magnetometer_s_curves_ascend_in_its_own_units(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, units: str, u: str, f: str
) -> None:
    place = micromag(tmp_path, monkeypatch, units)
    found, made = hysteresis._find_curves(given(place), Options())
    assert made == {"u": u, "f": f}
    assert found.kind == "ascending" and len(found.curves) == 10 and found.records == []
    assert hysteresis._find_curves(given(place), Options(curves="ascending"))[0].kind == "ascending"
    with pytest.raises(InputError, match="--curves: 'descending'; accepted: ascending, the only"):
        hysteresis._find_curves(given(place), Options(curves="descending"))
    drifting, _ = hysteresis._find_curves(given(place), Options(drift=True))
    np.testing.assert_array_equal(drifting.curves[3][1], 2.0 * found.curves[3][1])
    other = written(tmp_path / "a.csv", relays(TOPS))
    with pytest.raises(InputError, match=r"--drift: .*a\.csv is not a MicroMag file"):
        hysteresis._find_curves(given(other), Options(drift=True))
    for files in ((place, other), (other, place)):
        with pytest.raises(InputError, match="FILE: 2 files were given"):
            hysteresis._find_curves(given(*files), Options())


def test_files_of_columns_share_the_units_of_the_first(tmp_path: Path) -> None:
    file = written(tmp_path / "a.csv", relays(TOPS))
    found, units = hysteresis._find_curves(given(file), Options())
    assert units == {"u": "V", "f": "mm", "curve": ""}
    assert len(found.curves) == 10 and found.kind == "descending"


@pytest.mark.slow
def test_smoothing_by_curves_held_out(tmp_path: Path) -> None:
    """What is taken predicts held-out curves best; each error is that of tables made anew."""
    random = np.random.default_rng(2)
    pairs = [(u, f + 0.05 * random.standard_normal(len(f))) for u, f in relays(TOPS, n=21)]
    file = written(tmp_path / "noisy.csv", pairs)
    found = hysteresis.identify(given(file), Options(smooth="auto", shape="free"))
    said = dict(found.remarks)["along the input"]
    assert "along the output" not in dict(found.remarks)
    tried = {float(a): float(b) for a, b in re.findall(r"(\d+\.?\d*) ([\d.]+)(?:,|$)", said)}
    assert list(tried) == [0.5, 1.0, 2.0, 4.0, 8.0]
    assert tried[found.model.smooth] == min(tried.values())
    squares = []
    for fold in range(3):
        unseen = [1 + k for k in range(8) if k % 3 == fold]
        seen = [p for k, p in enumerate(pairs) if k not in unseen]
        own = FodTable.from_curves(seen, "descending", shape="free", smooth=2.0, limits=(LOW, HIGH))
        squares += [own.misfit([pairs[k] for k in unseen]).rms ** 2] * len(unseen)
    want = 100.0 * np.sqrt(np.mean(squares)) / found.data["range"]
    assert tried[2.0] == pytest.approx(want, rel=0.005)  # three digits are told
    few = written(tmp_path / "few.csv", pairs[::2])
    with pytest.raises(InputError, match=r"--smooth: auto needs .* there are 5"):
        hysteresis.identify(given(few), Options(smooth="auto"))
    with pytest.raises(InputError, match="--smooth: 'much'; accepted: a length in grid steps"):
        hysteresis.identify(given(few), Options(smooth="much"))


def steep(many: int, points: int = 300) -> list[tuple[np.ndarray, np.ndarray]]:
    """Curves of wires whose branches are steep and lie apart by their reversal."""

    def relays(up: np.ndarray, down: np.ndarray) -> np.ndarray:
        return np.exp(-0.5 * ((up - 60.0) / 6.0) ** 2 - 2.0 * (up - down - 10.0) ** 2)

    table = FodTable.from_everett(from_density(relays, 20.0, 0.2, 401), 0.0, 4.0)
    grid, rising, _ = table.major_loop
    low, high = np.interp([0.12, 3.98], rising, grid)
    starts = [*np.linspace(low, high, many - 1), table.hi]
    return [(u, table.curve(u[0], u)) for u in (np.linspace(s, 20.0, points) for s in starts)]


@pytest.mark.slow
def test_tables_are_compared_roughly_and_the_one_chosen_is_made_with_care(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    real = FodTable.from_curves

    def made(*args: Any, **options: Any) -> FodTable:
        asked.append(options["rounds"])
        return real(*args, **options | {"shape": "free"})  # which needs no rounds

    monkeypatch.setattr(hysteresis.FodTable, "from_curves", made)
    file = written(tmp_path / "steep.csv", steep(8, 40))
    hysteresis.identify(given(file), Options(smooth="auto", shape="nonnegative"))
    assert set(asked) == {ROUGH, ROUNDS} and asked.count(ROUNDS) == 2  # all, and every second


def test_the_way_between_curves_is_chosen_by_curves_held_out(tmp_path: Path) -> None:
    """Where branches are steep and curves few, along the output; else as it was."""
    file = written(tmp_path / "steep.csv", steep(8))
    found = hysteresis.identify(given(file), Options(shape="free", between="auto"))
    said = dict(found.remarks)
    tried = {way: float(said[f"along the {way}"].rsplit(" ", 1)[1]) for way in ("input", "output")}
    assert found.model.between == "output" and tried["output"] < tried["input"]
    assert found.model.smooth == 1.0
    once = hysteresis.identify(given(file), Options(shape="free", between="output"))
    np.testing.assert_array_equal(once.model.values, found.model.values)
    with pytest.raises(InputError, match="--between: 'steps'; accepted: input, output, auto"):
        hysteresis.identify(given(file), Options(between="steps"))
    few = written(tmp_path / "few.csv", steep(5))
    with pytest.raises(InputError, match=r"--between: auto needs .* there are 5"):
        hysteresis.identify(given(few), Options(between="auto"))


@pytest.mark.slow
def test_what_is_held_out_chooses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The error told for every second curve is of a table chosen by the other ones alone."""
    pairs = steep(15)
    given_to: list[int] = []
    real = hysteresis.held_out_errors
    monkeypatch.setattr(
        hysteresis,
        "held_out_errors",
        lambda make, some: given_to.append(len(some)) or real(make, some),
    )
    file = written(tmp_path / "steep.csv", pairs)
    hysteresis.identify(given(file), Options(shape="free", between="auto"))
    assert given_to == [15, 8]
