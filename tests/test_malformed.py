"""Malformed input of every kind: exit status 2 and one message that names file, key and remedy."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from macromicro import __main__
from macromicro.columns import Column
from macromicro.recorder import Recorder

AXIS = 'machine = "axis"\n'
MOVE = '[[moves]]\nmacro = "1 mm"\nhold = "1 s"\n'
GOOD = "t_s,u_V,x_mm\n" + "".join(f"{0.01 * k:.2f},{k % 7},{k % 5}\n" for k in range(300))

# Settings: text of s.toml, and what the message names.
SETTINGS = {
    "no TOML": ("machine = axis\n", "s.toml"),
    "twice the same key": (AXIS + "[load]\nmass = '1 kg'\nmass = '2 kg'\n", "s.toml"),
    "no such machine": ("machine = 'crane'\n", "s.toml, machine: 'crane'"),
    "a machine that is a number": ("machine = 3\n", "s.toml, machine"),
    "no such table": (AXIS + "[lod]\nmass = '1 kg'\n", "s.toml, lod"),
    "no such key": (AXIS + "[load]\nmas = '1 kg'\n", "s.toml, load.mas"),
    "a table as a value": (AXIS + "[load]\nmass = { a = 1 }\n", "s.toml, load.mass"),
    "a value as a table": (AXIS + "load = '1 kg'\n", "s.toml, load"),
    "no unit": (AXIS + "[load]\nmass = 1\n", "s.toml, load.mass: '1'"),
    "another unit": (AXIS + "[load]\nmass = '1 mm'\n", "s.toml, load.mass: '1 mm'"),
    "a unit that is none": (AXIS + "[load]\nmass = '1 stone'\n", "s.toml, load.mass"),
    "below its bounds": (AXIS + "[load]\nmass = '-1 kg'\n", "s.toml, load.mass: '-1 kg'"),
    "zero": (AXIS + "[motion]\njerk = '0 m/s^3'\n", "s.toml, motion.jerk: '0 m/s^3'"),
    "not a number": (AXIS + "[load]\nmass = 'nan kg'\n", "s.toml, load.mass: 'nan kg'"),
    "infinite": (AXIS + "[load]\nmass = 'inf kg'\n", "s.toml, load.mass: 'inf kg'"),
    "a list": (AXIS + "[load]\nmass = ['1 kg', '2 kg']\n", "s.toml, load.mass"),
    "true": (AXIS + "[load]\nmass = true\n", "s.toml, load.mass"),
    "an empty text": (AXIS + "[load]\nmass = ''\n", "s.toml, load.mass"),
    "a word of none of its choices": (AXIS + "[drive]\nkind = 'rope'\n", "s.toml, drive.kind"),
    "a part of a count": (AXIS + "[timing]\nsteps = 1.5\n", "s.toml, timing.steps"),
    "stops the wrong way round": (
        AXIS + "[load]\nstop_low = '1 mm'\nstop_high = '-1 mm'\n",
        "s.toml, load.stop",
    ),
    "too heavy to follow from": (AXIS + "[load]\npayload = '1e300 kg'\n", "s.toml, "),
    "a divisor of nothing": (AXIS + "[drive]\nradius = '8e-15 m'\n", "s.toml, controller"),
    "an angle's parts on a slide": ("machine = 'rotary'\n[load]\nmass = '1 kg'\n", "load.mass"),
    "a wire that never cools": (
        "machine = 'wire'\n[wire]\ncool_end = '6e7 degC'\n",
        "s.toml, ",
    ),
    "a piezo that is none": ("machine = 'piezo'\n[guide]\nresonance = '0 Hz'\n", "guide.resonance"),
    "xy without such an axis": ("machine = 'xy'\n[z.load]\nmass = '1 kg'\n", "s.toml, z"),
    "xy of two clocks": ("machine = 'xy'\n[x.timing]\nperiod = '2 ms'\n", "timing.period"),
    "a control character": (AXIS + "[load]\nmass = '1\x07 kg'\n", "s.toml"),
    "only the two-stage machine's": (AXIS + "[bench.friction]\ncoulomb = '9 N'\n", "bench"),
}
# Programmes of the machine axis: text of p.toml or p.csv.
PROGRAMMES = {
    "nothing": ("p.toml", "", "p.toml"),
    "no moves": ("p.toml", "title = 'x'\n", "p.toml"),
    "moves that are a table": ("p.toml", "[moves]\nmacro = '1 mm'\n", "p.toml, moves"),
    "no target": ("p.toml", "[[moves]]\nhold = '1 s'\n", "p.toml, move 1"),
    "no hold": ("p.toml", "[[moves]]\nmacro = '1 mm'\n", "p.toml, move 1"),
    "a negative hold": ("p.toml", MOVE.replace("1 s", "-1 s"), "p.toml, move 1, hold"),
    "a target without a unit": ("p.toml", MOVE.replace("1 mm", "1"), "p.toml, move 1"),
    "a target beyond the way": ("p.toml", MOVE.replace("1 mm", "9 km"), "9 km"),
    "a target of words": ("p.toml", MOVE.replace("1 mm", "there"), "p.toml, move 1"),
    "a profile without limits": ("p.toml", "[[profiles]]\nmacro = '1 mm'\n", "p.toml, profile 1"),
    "a jerk of nothing": (
        "p.toml",
        "[[profiles]]\nmacro = '1 mm'\nvelocity = '1 mm/s'\nacceleration = '1 m/s^2'\n"
        "jerk = '0 m/s^3'\nhold = '1 s'\n",
        "p.toml, profile 1, jerk",
    ),
    "a column of nothing": ("p.csv", "t_s,macro_mm\n0,\n", "p.csv, line 2"),
    "a row too short": ("p.csv", "t_s,macro_mm\n0,0\n1\n", "p.csv, line 3"),
    "a cell of words": ("p.csv", "t_s,macro_mm\n0,0\n1,far\n", "p.csv, line 3"),
    "times that fall": ("p.csv", "t_s,macro_mm\n1,0\n0,1\n", "p.csv, line"),
    "no time": ("p.csv", "macro_mm\n1\n", "p.csv"),
    "one row": ("p.csv", "t_s,macro_mm\n", "p.csv"),
}
# Measured data: content of d.csv, or another name, for `identify drive`.
DATA = {
    "an empty file": ("d.csv", "", "d.csv"),
    "only a heading": ("d.csv", "t_s,u_V,x_mm\n", "d.csv"),
    "no column for u": ("d.csv", GOOD.replace("u_V", "note"), "d.csv: there is no column for u"),
    "the same column twice": ("d.csv", GOOD.replace("x_mm", "u_V"), "d.csv"),
    "a word in a row": ("d.csv", GOOD.replace("0.50,1,0", "0.50,one,0"), "d.csv, line 52, u_V"),
    "a row too long": ("d.csv", GOOD.replace("0.50,1,0", "0.50,1,0,9"), "d.csv, line 52"),
    "another kind of unit": ("d.csv", GOOD.replace("x_mm", "x_kg"), "d.csv, x_kg"),
    "times that stand": ("d.csv", "t_s,u_V,x_mm\n" + "1,1,1\n" * 300, "d.csv"),
    "few rows": ("d.csv", "\n".join(GOOD.splitlines()[:20]), "d.csv"),
    "nothing moves": (
        "d.csv",
        "t_s,u_V,x_mm\n" + "".join(f"{0.01 * k:.2f},1,0\n" for k in range(300)),
        "d.csv",
    ),
    "no number in any row": ("d.csv", GOOD.replace(",", ",nan,", 1), "d.csv"),
    "no kind that is known": ("d.xyz", GOOD, "d.xyz"),
    "HDF5 by its name alone": ("d.h5", GOOD, "d.h5"),
    "MAT by its name alone": ("d.mat", GOOD, "d.mat"),
    "npz by its name alone": ("d.npz", GOOD, "d.npz"),
    "Parquet by its name alone": ("d.parquet", GOOD, "d.parquet"),
    "bytes": ("d.csv", "\x00\x01\x02" * 50, "d.csv"),
}
OPTIONS = {
    "no such command": ("runn", "runn"),
    "no such option": ("run --sped 3", "--sped"),
    "a seed of words": ("run --seed one", "--seed"),
    "cycles below one": ("run --cycles 0", "--cycles: 0"),
    "no such format": ("run --figures gif", "--figures: 'gif'"),
    "a port of no board": ("run --port /dev/none", "--port"),
    "a loop of no board": ("run --loop host", "--loop"),
    "no such rig": ("run --rig none", "--rig: 'none'"),
    "no such module of a rig": ("run --rig nowhere:rig", "--rig nowhere:rig"),
    "no such replay": ("run --rig replay:none.h5", "none.h5"),
    "no such law": ("run --law best", "--law"),
    "no such key": ("config show friction.none", "friction.none"),
    "no such machine": ("config show --machine crane", "--machine: 'crane'"),
    "an axis beside a machine": ("config show --axis x --machine axis", "--machine"),
    "no such axis": ("config show --axis z", "--axis: 'z'"),
    "no such stage": ("tune nano", "nano"),
    "no such objective": ("tune macro --objective best", "best"),
    "few designs": ("tune macro --evaluations -3", "--evaluations: '-3'"),
    "benches without robust": ("tune macro --benches 3", "--benches"),
    "a penalty of words": ("tune macro --penalty overshoot=much", "--penalty"),
    "no machines": ("robust --samples 0", "--samples"),
    "no spec": ("sweep", "sweep"),
    "a list and a picture": ("sweep --list --show", "--list"),
    "both ways to go on": ("commission --resume --overwrite", "--resume"),
    "pictures that are not drawn": ("commission --kind two_stage --figures svg", "--figures"),
    "no pitch": ("commission --rig nowhere:rig", "--pitch"),
    "a kiln alone": ("commission --kiln nowhere:kiln", "--kiln"),
    "no such claim": ("reproduce --only Z99", "Z99"),
    "a recording that is not there": ("plot none.h5", "none.h5"),
    "a picture of no kind": ("plot good.h5 --out a.bmp", "--out a.bmp"),
    "no such column": ("plot good.h5 speed", "speed"),
    "a time of words": ("plot good.h5 --from soon", "--from: 'soon'"),
    "one to compare": ("compare good.h5", "good.h5"),
    "an identification of nothing": ("identify drive", "FILE"),
    "no such identification": ("identify mass good.h5", "mass"),
    "overwriting nothing": ("identify drive good.h5 --overwrite", "--overwrite"),
    "columns of nothing": ("identify drive good.h5 --columns x", "--columns: 'x'"),
    "no such role": ("identify drive good.h5 --columns q=t", "--columns: 'q'"),
    "a look at nothing": ("look none.csv", "none.csv"),
    "a look at a folder": ("look .", "a directory"),
    "no such procedure": ("collect levitation", "levitation"),
    "no such export": ("export c axis.none", "axis.none"),
    "no such shell": ("completion fish2", "fish2"),
    "no such example": ("programmes none", "none"),
}
SHOW, RUN, FIT = "config show --config s.toml", "run {} --config axis.toml", "identify drive {}"
CASES = {
    **{f"settings, {k}": ("s.toml", text, SHOW, words) for k, (text, words) in SETTINGS.items()},
    **{f"programme, {k}": (n, text, RUN.format(n), w) for k, (n, text, w) in PROGRAMMES.items()},
    **{f"data, {k}": (n, text, FIT.format(n), words) for k, (n, text, words) in DATA.items()},
    **{f"options, {k}": ("", "", line, words) for k, (line, words) in OPTIONS.items()},
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("malformed")
    (folder / "axis.toml").write_text(AXIS + "[load]\nmass = '1 kg'\n")
    columns = (Column("t", "s", "time"), Column("x", "m", "place"))
    with Recorder(folder / "good.h5", columns, 10, 1e-3, {}) as recorder:
        recorder.append(np.array([1e-3 * np.arange(10), np.arange(10.0)]))
    return folder


@pytest.mark.parametrize("case", CASES)
def test_malformed_input_is_one_message_that_names_it(
    case: str,
    place: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    name, text, line, words = CASES[case]
    monkeypatch.chdir(place)
    before = {path.name for path in place.iterdir()}
    if name:
        (place / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["macromicro", *line.split()])
    status = __main__.main()
    if name:
        (place / name).unlink()
    said = capsys.readouterr().err
    assert status == 2, said
    assert "Traceback" not in said and words in said
    assert {path.name for path in place.iterdir()} == before
