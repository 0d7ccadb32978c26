"""What docs/sweep.md shows works."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from macromicro import batch
from macromicro.sweeps import run
from macromicro.sweeps._spec import load

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "sweep.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    assert len(found) == 1
    return str(found[0])


def test_the_spec_loads(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("[controller]\nmacro_law = 'pid'\n")
    (tmp_path / "spec.toml").write_text(block("toml"))
    spec, _ = load(tmp_path / "spec.toml", batch.job)
    assert [axis.path.rpartition(".")[2] for axis in spec.axes] == [
        "coulomb",
        "bristle",
        "frequency",
    ]
    assert spec.variants == 300 and spec.metrics == ("settling_time",)


def test_the_three_lines_that_read_the_results(tmp_path: Path) -> None:
    """On a coarser grid of the same example."""
    text = (ROOT / "examples" / "sweep-gains.toml").read_text().replace("steps = 40", "steps = 8")
    (tmp_path / "sweep-gains.toml").write_text(text)
    out = tmp_path / "results" / "sweep-gains"
    ready = run.check(run.Request(tmp_path / "sweep-gains.toml", out, 1))
    run.execute(ready, lambda *_: None, lambda *_: None, lambda: False)
    code = block("python")
    assert len([line for line in code.splitlines() if line]) == 3
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    times = [float(t) for t in re.findall(r"'settling_time': ([\d.]+)", done.stdout)]
    assert len(times) == 5 and times == sorted(times)
