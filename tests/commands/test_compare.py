"""`macromicro compare`: figures, the table, the numbers, and what cannot be compared."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from macromicro import Recording, Settings, api
from macromicro.columns import Column
from tests.command import command as macromicro

SHORT = """title = "short"
[[moves]]
macro = ["20 mm"]
micro = ["1 mm"]
hold = "1 s"
"""


def command(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return macromicro("compare", *words, cwd=cwd)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same short programme with other friction, as a folder and as a file, and a copy."""
    place = tmp_path_factory.mktemp("runs")
    (place / "short.toml").write_text(SHORT)
    (place / "nominal").mkdir()
    sticky = Settings().with_("bench.friction.coulomb", "11 N")
    api.run(place / "short.toml", seed=1).save(place / "nominal" / "recording.h5")
    api.run(place / "short.toml", seed=1).save(place / "again.h5")
    api.run(place / "short.toml", seed=1, settings=sticky).save(place / "sticky.h5")
    return place


@pytest.fixture(scope="module")
def done(runs: Path) -> subprocess.CompletedProcess[str]:
    words = ("nominal", "sticky.h5", "again.h5", "--out", "out", "--figures", "svg,png")
    return command(*words, cwd=runs)


def test_figures_and_numbers_are_left(runs: Path, done: subprocess.CompletedProcess[str]) -> None:
    assert done.returncode == 0, done.stderr
    made = {p.name for p in (runs / "out").iterdir()}
    assert made == {"compare.json", "overlay.html", "overlay.png", "overlay.svg"}
    told = json.loads((runs / "out" / "compare.json").read_text())
    assert [r["name"] for r in told["recordings"]] == ["nominal", "sticky", "again"]
    assert told["first_difference"][0]["t_s"] < 0.1
    assert told["first_difference"][1] == {
        "rows": told["recordings"][0]["rows"], "t_s": None, "columns": [],
    }  # fmt: skip


def test_differences_are_those_of_the_moves(
    runs: Path, done: subprocess.CompletedProcess[str]
) -> None:
    """As `macromicro.moves` measures each recording."""
    told = json.loads((runs / "out" / "compare.json").read_text())
    first, other = (
        api.moves(Recording.load(runs / name)) for name in ("nominal/recording.h5", "sticky.h5")
    )
    assert [m["target"] for m in told["moves"]] == [m.target for m in first] == [20.0, 1000.0]
    for found, a, b in zip(told["moves"], first, other, strict=True):
        assert found["settling_s"] == [a.settling_s, b.settling_s, a.settling_s]
        assert a.settling_s is not None and b.settling_s is not None
        assert found["settling_s_difference"] == [b.settling_s - a.settling_s, 0.0]
        assert a.final_error is not None and b.final_error is not None
        assert found["final_error_difference"][0] == b.final_error - a.final_error
    assert told["moves"][0]["settling_s_difference"][0] > 0.0


def test_the_table_names_moves_and_differences(done: subprocess.CompletedProcess[str]) -> None:
    lines = done.stdout.splitlines()
    assert [line.split()[:5] for line in lines[2:6]] == [
        ["sticky", "1", "macro", "20", "mm"], ["again", "1", "macro", "20", "mm"],
        ["sticky", "2", "micro", "1000", "um"], ["again", "2", "micro", "1000", "um"],
    ]  # fmt: skip
    assert "again: equal to nominal in all 27 shared columns, bit for bit" in lines


def test_the_table_names_the_columns_that_differ(
    done: subprocess.CompletedProcess[str], runs: Path
) -> None:
    """With unit, RMS and largest difference; none of them is of the equal recording."""
    lines = done.stdout.splitlines()
    start = lines.index("Columns that differ from nominal")
    assert lines[start + 1].split() == [
        "compared",
        "column",
        "unit",
        "RMS",
        "difference",
        "largest",
        "at",
    ]
    cells = [line.split() for line in lines[start + 2 : lines.index("", start)]]
    one, other = (Recording.load(runs / n) for n in ("nominal/recording.h5", "sticky.h5"))
    rows = min(len(one), len(other))
    apart = np.abs(one["motor"][:rows] - other["motor"][:rows])
    told = {line[1]: line for line in cells}
    assert {line[0] for line in cells} == {"sticky"}
    size, at = f"{apart.max():.4g}", f"{1e-3 * apart.argmax():.3f}"
    assert told["motor"] == [
        "sticky",
        "motor",
        "V",
        f"{np.sqrt(np.mean(apart**2)):.4g}",
        size,
        at,
        "s",
    ]


def test_json_alone(runs: Path, done: subprocess.CompletedProcess[str]) -> None:
    found = command("nominal", "sticky.h5", "--out", "other", "--json", cwd=runs)
    assert found.returncode == 0, found.stderr
    assert json.loads(found.stdout) == json.loads((runs / "other" / "compare.json").read_text())


def test_an_existing_folder(runs: Path, done: subprocess.CompletedProcess[str]) -> None:
    """Refused; replaced if asked, with nothing left of the earlier comparison."""
    refused = command("nominal", "sticky.h5", "--out", "out2", cwd=runs)
    assert refused.returncode == 0
    refused = command("nominal", "sticky.h5", "--out", "out2", cwd=runs)
    assert refused.returncode == 2 and "--overwrite" in refused.stderr
    again = ("--out", "out2", "--figures", "pdf", "--overwrite")
    assert command("nominal", "sticky.h5", *again, cwd=runs).returncode == 0
    made = {p.suffix for p in (runs / "out2").iterdir()}
    assert made == {".json", ".html", ".pdf"}


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "compare: 'nothing'; accepted: two or more"),
        ("nominal", "compare: 'nominal'; accepted: two or more"),
        ("nominal nowhere.h5", "nowhere.h5: no such file"),
        ("nominal short.toml", "short.toml: the format .toml is not known"),
        ("nominal .", "the folder has no recording.h5"),
        ("nominal other.h5", "share no columns"),
        ("nominal empty.h5", "empty.h5: the recording has no rows"),
        ("nominal sticky.h5 --figures gif", "--figures: 'gif'"),
    ],
)
def test_bad_input(words: str, said: str, runs: Path) -> None:
    """One message, exit 2, nothing written."""
    t, x = Column("t", "s", "time"), Column("x", "m", "place")
    for name, column, dt, rows in (
        ("other", x, 1e-3, 5), ("empty", x, 1e-3, 0),
    ):  # fmt: skip
        path = runs / f"{name}.h5"
        if not path.exists():
            time = dt * np.arange(rows)
            Recording.from_arrays((t, column), [time, time], dt, {}).save(path)
    done = command(*words.split(), "--out", "bad", cwd=runs)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
    assert said in done.stderr and not (runs / "bad").exists()
