"""What CONTRIBUTING says of a new control law, done to the letter in a copy of the package."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import macromicro

LAW = '''"""A proportional law of the error alone."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.kernel import kernel
from macromicro.parameters import Par


class Plain(NamedTuple):
    """Gains."""

    kp: Annotated[float, Par("V/count", "proportional gain", lo=0.0, hi=1.0)] = 0.004


@kernel
def step(p: Plain, error: float) -> float:
    """Effort [V] for an error [counts]."""
    return p.kp * error
'''

BATCH = """
import numpy as np
from macromicro import batch
job = batch.job("macro-bench", settings=__import__("macromicro").load_settings("mine.toml"))
found = job.evaluate(batch.Variants(("controller.plain.kp",), np.array([[0.002], [0.004]])))
assert found.shape[0] == 2 and not (found[0] == found[1]).all(), found
"""


def edit(path: Path, *pairs: tuple[str, str]) -> None:
    text = path.read_text()
    for old, new in pairs:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    path.write_text(text)


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package with one more law: a file, and the lines that list it."""
    place = tmp_path_factory.mktemp("copy")
    package = place / "macromicro"
    source = Path(macromicro.__file__).parent
    shutil.copytree(source, package, ignore=shutil.ignore_patterns("__pycache__"))
    (package / "control" / "plain.py").write_text(LAW)
    edit(
        package / "control" / "macro.py",
        ('"pd-tuned")', '"pd-tuned", "plain")'),
        ("    pd_tuned: PdTuned\n", "    pd_tuned: PdTuned\n    plain: Plain\n"),
        (
            "    else:\n        effort = pd.step(p.pd_tuned",
            "    elif p.law == 3:\n        effort = plain.step(p.plain, error)\n"
            "    else:\n        effort = pd.step(p.pd_tuned",
        ),
        (
            "from macromicro.kernel import kernel\n",
            "from macromicro.control import plain\nfrom macromicro.control.plain import Plain\n"
            "from macromicro.kernel import kernel\n",
        ),
    )
    edit(
        package / "control" / "settings.py",
        ("    pd_tuned: PdTuned = PdTuned()\n",
         "    pd_tuned: PdTuned = PdTuned()\n    plain: Plain = Plain()\n"),
        ("from macromicro.control.pid import Pid\n",
         "from macromicro.control.pid import Pid\nfrom macromicro.control.plain import Plain\n"),
    )  # fmt: skip
    (place / "mine.toml").write_text('[controller]\nmacro_law = "plain"\n')
    (place / "use.py").write_text(BATCH)
    return place


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ["-m", "macromicro", "run", "staircase", "--config", "mine.toml", "--json"],
        ["-m", "macromicro", "tune", "macro", "--config", "mine.toml", "--evaluations", "20"],
        ["use.py"],
    ],
    ids=["run", "tune", "batch"],
)
def test_a_law_added_by_the_book_works(copy: Path, words: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, *words],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": str(copy), "MACROMICRO_CACHE": str(copy / "cache")},
        capture_output=True, text=True, timeout=400, check=False,
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    # A P law may leave the carriage short of its target, which `run` says with 1.
    assert done.returncode in ((0, 1) if "run" in words else (0,)), done.stderr
