"""What is handed out: a wheel and a source archive that work without this checkout, a citation."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import yaml

import macromicro

ROOT = Path(__file__).parents[1]
SHORT = """title = "short"
[[moves]]
macro = ["5 mm"]
hold = "0.1 s"
"""


def done(*words: str | Path, cwd: Path, **more: str) -> str:
    """What a command prints that ends well."""
    found = subprocess.run(
        list(map(str, words)), cwd=cwd, env={**os.environ, **more},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert found.returncode == 0, found.stdout + found.stderr
    return found.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Wheel and source archive; the wheel is built from the archive."""
    out = tmp_path_factory.mktemp("dist")
    done(sys.executable, "-m", "build", "--no-isolation", "--outdir", out, ROOT, cwd=out)
    return out


@pytest.mark.slow
def test_wheel_and_source_archive_hold_every_file(dist: Path) -> None:
    (wheel,), (archive,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    checked = done(sys.executable, "-m", "twine", "check", "--strict", wheel, archive, cwd=dist)
    assert checked.count("PASSED") == 2
    assert wheel.stat().st_size < 3e6
    sources = {
        "": ROOT / "src/macromicro",
        "examples/": ROOT / "examples",
        "examples/tutorials/": ROOT / "docs/tutorials",
    }
    kept = {
        f"macromicro/{place}{p.relative_to(folder).as_posix()}"
        for place, folder in sources.items()
        for p in folder.rglob("*")
        if p.is_file() and "__pycache__" not in p.parts
    }
    with zipfile.ZipFile(wheel) as file:
        held = {name for name in file.namelist() if ".dist-info/" not in name}
        assert any(name.endswith("/licenses/LICENSE") for name in file.namelist())
    assert held == kept
    with tarfile.open(archive) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    assert {"LICENSE", "README.md", "CITATION.cff", "constraints.txt", "Makefile"} <= names
    assert {"examples/machines/stage.toml", "deploy/macromicro.service"} <= names


@pytest.mark.slow
def test_the_wheel_runs_its_examples_in_an_empty_environment(dist: Path, tmp_path: Path) -> None:
    """With its dependencies alone: no extra, no checkout."""
    (wheel,) = dist.glob("*.whl")
    done(sys.executable, "-m", "venv", "env", cwd=tmp_path)
    scripts = tmp_path / "env" / ("Scripts" if os.name == "nt" else "bin")
    pip = ("-m", "pip", "install", "--quiet", "--no-compile", "-c", ROOT / "constraints.txt")
    done(scripts / "python", *pip, wheel, cwd=tmp_path, PYTHONPATH="")
    files = (p.lstat() for p in (tmp_path / "env").rglob("*") if p.suffix != ".pyc")
    assert sum(file.st_size for file in files) < 450e6

    def macromicro_(*words: str | Path) -> str:
        # Interpreted: compiling takes longer than the run.
        alone = {"PYTHONPATH": "", "NUMBA_DISABLE_JIT": "1"}
        return done(scripts / "macromicro", *words, cwd=tmp_path, **alone)

    assert "examples" in macromicro_("--help")
    assert macromicro_("--version") == f"macromicro {macromicro.__version__}\n"
    macromicro_("examples")
    assert (tmp_path / "examples/tutorials/motor.md").is_file()
    macromicro_("run", "--config", "examples/machines/piezo-100um.toml")
    (tmp_path / "short.toml").write_text(SHORT)
    macromicro_("run", "short.toml")
    macromicro_("plot", "results/short", "laser")
    macromicro_("reproduce", "--only", "D9")
    made_up = "from pathlib import Path; from own_csv import write; write(Path('own.csv'))"
    done(scripts / "python", "-c", made_up, cwd=tmp_path, PYTHONPATH="examples")
    macromicro_("identify", "drive", "own.csv", "--columns", "t=clock,u=amplifier,x=scale:mm")
    made = {
        p.relative_to(tmp_path / "results").as_posix()
        for p in (tmp_path / "results").rglob("*.html")
    }
    assert {
        "short/report.html",
        "piezo-100um/report.html",
        "plot/short.html",
        "reproduction/reproduction.html",
    } <= made


def test_the_citation_has_what_its_format_asks_for() -> None:
    """Citation File Format 1.2.0: required keys, and kinds of their values."""
    told = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} <= set(told)
    assert told["cff-version"] == "1.2.0" and told["type"] == "software"
    assert all(set(author) == {"name"} and author["name"] for author in told["authors"])
    assert told["version"] == macromicro.__version__
    assert told["license"] == "MIT" and (ROOT / "LICENSE").read_text().startswith("MIT License")
    assert all(isinstance(told[key], str) and told[key] for key in ("message", "title", "abstract"))
    assert all(isinstance(word, str) for word in told["keywords"])
