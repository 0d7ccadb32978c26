"""`identify plays`: the loop of a piezo stage from a recording of it."""

from __future__ import annotations

import json
import tomllib
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from macromicro import identify
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.hysteresis import prandtl_loop
from macromicro.hysteresis.prandtl import Prandtl
from macromicro.hysteresis.prandtl_fit import PrandtlFit
from macromicro.identify.play_operators import Loop
from macromicro.identify.result import Line, Result
from macromicro.machines import machine
from macromicro.machines.parts import Timing
from macromicro.machines.piezo import Piezo
from macromicro.plant import piezo

DT = 1e-3
CORNERS = [0.0, 100.0, 0.0, 90.0, 20.0, 100.0, 0.0, 70.0, 10.0, 60.0]


@cache
def recorded() -> tuple[Array, Array]:
    """Volts, and what the sensor of the piezo stage showed [m], slowly and with creep."""
    p = piezo.prepare(Piezo(timing=Timing(1e-4, 0.0, 1)))
    pieces = [np.linspace(a, b, int(abs(b - a) / 0.2) + 1)[1:] for a, b in pairwise(CORNERS)]
    volts = np.concatenate(pieces)
    noise = np.random.default_rng(5).standard_normal(volts.size)
    s, shown = piezo.initial(p), np.empty(volts.size)
    for k, v in enumerate(volts):
        s = piezo.advance(p, s, 0.1 * float(v), DT)
        shown[k] = piezo.measured(p, s, noise[k])
    return volts, shown


def written(path: Path, volts: Array, x: Array, head: str = "t_s,u_V,x_um") -> Path:
    """A person's CSV file."""
    rows = np.c_[np.arange(volts.size) * DT, volts, 1e6 * x]
    np.savetxt(path, rows, delimiter=",", header=head, comments="")
    return path


def line(found: Result, name: str) -> Line:
    """The line of that name."""
    return next(one for one in found.lines if one.name == name)


def test_a_piezo_stage_loop_is_found_to_parts_of_a_percent(tmp_path: Path) -> None:
    """Creep and the rate are not in the model: 0.5 % of the range is left on what was held out."""
    file = written(tmp_path / "own.csv", *recorded())
    again = written(tmp_path / "again.csv", *recorded())
    found = identify.from_files("plays", file, tests=(str(again),))
    assert isinstance(found.model, Prandtl)
    true = piezo.loop(piezo.Stack(), piezo.Hidden())
    loop = prandtl_loop.measured(true.thresholds, true.weights, 100.0)
    assert line(found, "stroke").value == pytest.approx(1e6 * loop.stroke, rel=0.03)
    assert line(found, "loop width").value == pytest.approx(
        100.0 * loop.width / loop.stroke, rel=0.06
    )
    assert line(found, "stroke").unit == "um"
    assert line(found, "mean gain").unit == "um/V"
    held = line(found, "prediction")
    assert 0.0 < held.value < 0.5
    assert held.unit == "% of range"
    assert 0.0 < line(found, "misfit").value < 0.5
    told = dict(found.remarks)
    assert told["plays"].startswith("16, ")
    assert "held out" in told["samples"]
    again = float(told[f"prediction of {again}"].split()[1])
    assert 0.0 < again < 0.5


def test_files_hold_the_operator_and_three_figures(tmp_path: Path) -> None:
    file = written(tmp_path / "own.csv", *recorded())
    found = identify.from_files("plays", file, plays=6)
    found.save(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {
        "result.json", "model.toml", "curves.png", "residuals.png", "thresholds.png",
    }  # fmt: skip
    data = json.loads((tmp_path / "out/result.json").read_text())["data"]
    # The model file is one of settings for the machine that it was measured on.
    kind, tree = machine.load(tmp_path / "out/model.toml")
    assert kind is not None and kind.name == "piezo"
    assert tree.controller.loop_thresholds == pytest.approx(data["thresholds"], rel=1e-6)
    assert [1e6 * w for w in tree.controller.loop_weights] == pytest.approx(
        found.model.weights.tolist(), rel=1e-6
    )
    assert len(data["weights"]) == 6
    assert data["holdout_rms"] > 0.0


def test_of_other_quantities_the_model_file_holds_the_operator(tmp_path: Path) -> None:
    file = written(tmp_path / "own.csv", *recorded(), head="t_s,field,x_um")
    found = identify.from_files("plays", file, plays=4)
    table = tomllib.loads(found.to_toml())["hysteresis"]
    assert table["weights"] == pytest.approx(found.model.weights.tolist(), rel=1e-6)
    assert table["thresholds"] == pytest.approx(found.model.thresholds.tolist(), rel=1e-6)
    assert table["offset"] == pytest.approx(found.model.offset, rel=1e-6)


def test_what_is_no_recording_both_ways_is_refused(tmp_path: Path) -> None:
    volts, x = recorded()
    own = written(tmp_path / "own.csv", volts, x)
    rising = written(tmp_path / "rising.csv", volts[:480], x[:480])
    curves = written(tmp_path / "curves.csv", volts, x, "curve,u_V,x_um")
    for files, options, named in (
        (own, {"plays": 1}, "2 to 200"),
        ([own, own], {}, "one recording"),
        (rising, {}, r"rising\.csv.*both ends"),
        (curves, {}, "curve.*over time"),
    ):
        with pytest.raises(InputError, match=named):
            identify.from_files("plays", files, **options)  # type: ignore[arg-type]


def test_the_table_of_curves_sends_a_major_loop_here(tmp_path: Path) -> None:
    ramp = np.r_[np.linspace(0.0, 100.0, 200), np.linspace(100.0, 0.0, 200)]
    file = written(tmp_path / "major.csv", np.tile(ramp, 2), 1e-6 * np.tile(ramp, 2))
    with pytest.raises(InputError, match=r"major loop only.*`identify plays`"):
        identify.from_files("hysteresis", file)
    found = identify.from_files("plays", file)
    assert line(found, "loop width").value == pytest.approx(0.0, abs=1e-6)


def test_what_the_command_writes_is_read_and_predicts_as_in_python(tmp_path: Path) -> None:
    volts, shown = recorded()
    np.savetxt(tmp_path / "own.csv", np.c_[volts, 1e6 * shown], delimiter=",", header="u_V,f_um")
    found = identify.from_files("plays", tmp_path / "own.csv")
    found.save(tmp_path / "loop")
    loop = identify.load_plays(tmp_path / "loop")
    same = identify.plays(volts, 1e6 * shown)
    assert loop.lag is None and isinstance(same, PrandtlFit)
    unit = float(np.ptp(same.outputs)) / float(np.ptp(loop.run(volts)))  # columns may be converted
    np.testing.assert_allclose(
        unit * loop.run(volts)[same.known :], same.outputs[same.known :], rtol=1e-3, atol=1e-3
    )
    rated = Loop(loop.operator, 0.01)
    with pytest.raises(InputError, match="dt"):
        rated.run(volts)
    assert np.ptp(rated.run(volts, 1.0) - loop.run(volts)) < 1e-2 * np.ptp(loop.run(volts))


@pytest.mark.parametrize(
    ("text", "words"),
    [(None, "no such file"), ("{", "not a result"), ('{"kind": "drive"}', "not a result")],
)
def test_what_is_no_loop_is_refused_by_name(tmp_path: Path, text: str | None, words: str) -> None:
    if text is not None:
        (tmp_path / "result.json").write_text(text)
    with pytest.raises(InputError, match=words) as refused:
        identify.load_plays(tmp_path / "result.json")
    assert "result.json" in str(refused.value) and "identify plays" in str(refused.value)
