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


@pytest.mark.slow
def test_wheel_and_source_archive_work_without_the_checkout(tmp_path: Path) -> None:
    """The wheel is built from the archive, installed alone, and runs from an empty folder."""
    dist, site, empty = (tmp_path / name for name in ("dist", "site", "empty"))
    empty.mkdir()
    done(sys.executable, "-m", "build", "--no-isolation", "--outdir", dist, ROOT, cwd=empty)
    (wheel,), (archive,) = dist.glob("*.whl"), dist.glob("*.tar.gz")
    told = done(sys.executable, "-m", "twine", "check", "--strict", wheel, archive, cwd=empty)
    assert told.count("PASSED") == 2

    package = ROOT / "src" / "macromicro"
    kept = {
        f"macromicro/{p.relative_to(package)}"
        for p in package.rglob("*")
        if p.is_file() and "__pycache__" not in p.parts
    }
    with zipfile.ZipFile(wheel) as file:
        held = {name for name in file.namelist() if ".dist-info/" not in name}
        assert any(name.endswith("/licenses/LICENSE") for name in file.namelist())
    assert held == kept
    for kind in (
        ".toml",
        ".json",
        ".html",
        ".js",
        ".j2",
        ".css",
        ".bob",
        ".csv",
        ".hex",
        "py.typed",
    ):
        assert any(name.endswith(kind) for name in held), kind
    with tarfile.open(archive) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    assert {"LICENSE", "README.md", "CITATION.cff", "constraints.txt", "Makefile"} <= names
    assert {"examples/machines/stage.toml", "deploy/macromicro.service"} <= names

    pip = ("-m", "pip", "install", "--quiet", "--no-index", "--no-deps", "--no-compile")
    done(sys.executable, *pip, "--target", site, wheel, cwd=empty)
    script, path = site / "bin" / "macromicro", {"PYTHONPATH": str(site)}
    where = done(sys.executable, "-c", "import macromicro; print(macromicro.__file__)",
                 cwd=empty, **path)  # fmt: skip
    assert Path(where.strip()).is_relative_to(site)
    assert done(script, "--version", cwd=empty, **path) == f"macromicro {macromicro.__version__}\n"
    (empty / "short.toml").write_text(SHORT)
    # Interpreted: compiling takes longer than the run.
    done(script, "run", "short.toml", cwd=empty, NUMBA_DISABLE_JIT="1", **path)
    done(script, "plot", "results/short", "laser", cwd=empty, **path)
    made = {str(p.relative_to(empty / "results")) for p in empty.rglob("*.html")}
    assert made == {"short/report.html", "plot/short.html"}


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
