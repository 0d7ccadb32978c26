"""``macromicro robust`` as a user meets it, on a short programme."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.command import command as macromicro
from tests.systems import posix
from tests.warm import Command

from macromicro.batch.programme_metrics import METRICS, NAMES, measure
from macromicro.robustness import files
from macromicro.robustness.subject import usual_requirements
from macromicro.runs import job as run
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.uncertainty.table import UNCERTAIN, VARIANTS

REQUIRED = usual_requirements(METRICS, {})

COMMAND = [sys.executable, "-m", "macromicro"]
SHORT = '[[moves]]\nmacro = ["20 mm"]\nmicro = ["1 mm", "0.5 mm"]\nhold = "1.2 s"\n'
SAMPLES = 12
FIRST_SEED = 3


def command(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return macromicro(*arguments, cwd=cwd)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, subprocess.CompletedProcess[str]]:
    """A study from a base that is not the default one, with a fan."""
    place = tmp_path_factory.mktemp("robust")
    (place / "short.toml").write_text(SHORT)
    (place / "base.toml").write_text('[bench.bias]\nplatform = "21 g"\n')
    arguments = ["robust", "--samples", str(SAMPLES), "--seed", str(FIRST_SEED), "--fan"]
    arguments += ["--programme", "short.toml", "--config", "base.toml", "--out", "out"]
    arguments += ["--figures", "svg,png"]
    return place, command(*arguments, cwd=place)


@pytest.fixture(scope="module")
def content(done: tuple[Path, subprocess.CompletedProcess[str]]) -> dict:
    return json.loads((done[0] / "out" / files.JSON).read_text())


def samples(folder: Path) -> Iterator[dict[str, str]]:
    with (folder / files.SAMPLES).open(newline="") as file:
        yield from csv.DictReader(file)


def number(value: float | str | None) -> float:
    """A number of robust.json."""
    return math.nan if value is None else float(value)


def test_exits_with_0_and_leaves_everything(
    done: tuple[Path, subprocess.CompletedProcess[str]], content: dict
) -> None:
    place, finished = done
    assert finished.returncode == 0, finished.stderr
    made = {p.name for p in (place / "out").iterdir()}
    own = {name for name in files.FILES if not name.endswith(".pdf")}
    assert made == own | {w["file"] for w in content["worst"]}
    assert "Traceback" not in finished.stderr
    assert all((place / "out" / n).read_bytes().startswith(b"\x89PNG") for n in made if "png" in n)


def test_says_yields_influences_and_how_to_repeat(
    done: tuple[Path, subprocess.CompletedProcess[str]], content: dict
) -> None:
    text = done[1].stdout
    whole = content["overall"]
    assert f"{whole['passed']} of {SAMPLES}" in text
    assert "coulomb (-30 %" in text
    for worst in content["worst"]:
        line = (
            f"macromicro run short.toml --config out/{worst['file']} --seed {worst['seed']} --fan"
        )
        assert line in text


def test_page_is_self_contained(done: tuple[Path, subprocess.CompletedProcess[str]]) -> None:
    page = (done[0] / "out" / files.PAGE).read_text()
    assert page.count("data:image/png;base64,") == 4
    assert not re.search(r"(?:src|href)=\"(?!data:)", page)
    assert "<script" not in page
    assert "bench.bias.platform = 21 g" in page


def test_csv_and_json_agree(
    done: tuple[Path, subprocess.CompletedProcess[str]], content: dict
) -> None:
    rows = list(samples(done[0] / "out"))
    assert [int(r["seed"]) for r in rows] == [FIRST_SEED + i for i in range(SAMPLES)]
    for worst in content["worst"]:
        assert float(rows[worst["sample"]][worst["metric"]]) == number(worst["value"])
    for each in content["requirements"]:
        values = [r[each["metric"]] for r in rows]
        passed = sum(v != "" and float(v) <= each["limit"] for v in values)
        assert each["yield"]["passed"] == passed
    assert {e["metric"] for e in content["requirements"]} == {r.metric.name for r in REQUIRED}


def test_worst_cases_replay_to_the_same_number(
    done: tuple[Path, subprocess.CompletedProcess[str]], content: dict
) -> None:
    """What `macromicro run` does with the file and the seed gives the metric, bit for bit."""
    place = done[0]
    assert len(content["worst"]) >= 3
    for worst in content["worst"][:2]:
        path = place / "out" / worst["file"]
        request = run.Request(
            str(place / "short.toml"), place / worst["metric"], path, 1, True, worst["seed"]
        )
        job = run.check(request)
        ended = run.execute(job)
        code = 0 if ended.fault is None else ended.fault.code
        found = measure(ended.recording, job.programme, job.settings, code)
        assert found[NAMES.index(worst["metric"])] == number(worst["value"]), worst


def test_the_printed_command_repeats_the_worst_error(
    done: tuple[Path, subprocess.CompletedProcess[str]], content: dict
) -> None:
    place, finished = done
    worst = next(w for w in content["worst"] if w["metric"] == "micro_error")
    found = re.search(r"macromicro (run .*worst-micro_error\.toml.*)", finished.stdout)
    assert found is not None
    again = command(*shlex.split(found[1]), "--json", "--out", "again", cwd=place)
    moves = json.loads(again.stdout)["moves"]
    errors = [abs(m["final_error"]) for m in moves if m["stage"] == "micro"]
    assert max(errors) == number(worst["value"])


def test_worst_files_hold_the_sample(
    done: tuple[Path, subprocess.CompletedProcess[str]], content: dict
) -> None:
    rows = list(samples(done[0] / "out"))
    for worst in content["worst"]:
        tree = config.load_overrides(done[0] / "out" / worst["file"], Settings())
        row = rows[worst["sample"]]
        assert tree.bench.thermal.ambient == float(row["ambient"])
        factor = Settings().bench.friction.coulomb * float(row["coulomb"])
        assert tree.bench.friction.coulomb == factor
        assert tree.bench.bias.platform == 0.021


@pytest.mark.slow
def test_a_second_study_needs_overwrite_and_cleans_up(
    done: tuple[Path, subprocess.CompletedProcess[str]], tmp_path: Path
) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    out = tmp_path / "out"
    out.mkdir()
    (out / "worst-old.toml").write_text("")
    limits = tmp_path / "limits.toml"
    limits.write_text("\n".join(f"{r.metric.name} = false" for r in REQUIRED[1:]))
    arguments = ["robust", "--samples", "10", "--programme", "short.toml", "--out", "out"]
    arguments += ["--requirements", "limits.toml"]
    refused = command(*arguments, cwd=tmp_path)
    assert refused.returncode == 2
    assert "--overwrite" in refused.stderr
    assert [p.name for p in out.iterdir()] == ["worst-old.toml"]
    finished = command(*arguments, "--overwrite", "--json", "--variants", cwd=tmp_path)
    assert finished.returncode == 0, finished.stderr
    drawn = [p["name"] for p in json.loads((out / files.JSON).read_text())["parameters"]]
    assert drawn == [u.name for u in (*UNCERTAIN, *VARIANTS)]
    assert [r["metric"] for r in json.loads(finished.stdout)["requirements"]] == ["fault"]
    assert {p.name for p in out.glob("worst-*")} == {"worst-fault.toml"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--samples", "9"], "from 10"),
        (["--samples", "many"], "many"),
        (["--seed", "-1"], "--seed"),
        (["--workers", "0"], "--workers"),
        (["--programme", "nothing"], "nothing"),
        (["--config", "none.toml"], "none.toml"),
        (["--config", "key.toml"], "frction"),
        (["--requirements", "unit.toml"], "micro_error"),
        (["--requirements", "none.toml"], "none.toml"),
        (["--out", "key.toml"], "a file"),
    ],
)
def test_bad_input_is_one_message(tmp_path: Path, arguments: list[str], words: str) -> None:
    (tmp_path / "key.toml").write_text('[bench.frction]\ncoulomb = "9 N"\n')
    (tmp_path / "unit.toml").write_text('micro_error = "5 s"\n')
    before = sorted(tmp_path.iterdir())
    finished = command("robust", *arguments, cwd=tmp_path)
    assert finished.returncode == 2
    assert words in finished.stderr
    assert "Traceback" not in finished.stderr
    assert finished.stdout == ""
    assert sorted(tmp_path.iterdir()) == before


@posix
@pytest.mark.slow
def test_ctrl_c_reports_what_is_done(tmp_path: Path) -> None:
    (tmp_path / "short.toml").write_text(SHORT)
    process = Command(
        [
            *COMMAND,
            "robust",
            "--samples",
            "2000",
            "--workers",
            "1",
            "--programme",
            "short.toml",
            "--out",
            "out",
        ],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env=os.environ,
    )
    assert process.stderr is not None
    for line in process.stderr:
        if "runs" in line:
            process.send_signal(signal.SIGINT)
            break
    text, words = process.communicate(timeout=300)
    assert process.returncode == 128 + signal.SIGINT
    assert "INCOMPLETE" in text
    assert "not run" in text
    assert "interrupted after" in words
    content = json.loads((tmp_path / "out" / files.JSON).read_text())
    assert content["interrupted"]
    assert 0 < content["samples_done"] < 2000
    assert content["overall"]["total"] == content["samples_done"]
    assert len(list(samples(tmp_path / "out"))) == content["samples_done"]
    assert "INCOMPLETE" in (tmp_path / "out" / files.PAGE).read_text()
