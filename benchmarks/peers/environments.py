"""An environment for every peer, made once: .venv-peers/<peer>, from requirements-<peer>.txt."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
FOLDER = HERE.parents[1] / ".venv-peers"
LONGEST = 900.0  # s, for one peer's installation


class NoEnvironmentError(RuntimeError):
    """A peer could not be installed."""


def requirements(name: str) -> Path:
    """The pinned versions of a peer and of all that it needs."""
    return HERE / f"requirements-{name}.txt"


def version(name: str, package: str) -> str:
    """The pinned version of `package` in the environment `name`, "" if it is not pinned."""
    for line in requirements(name).read_text(encoding="utf-8").splitlines():
        found, _, pinned = line.partition("==")
        if found.lower() == package.lower():
            return pinned
    return ""


def python(name: str) -> Path:
    """The interpreter of the environment `name`, which is made when it is missing or old.

    Raises NoEnvironmentError with the last words of what failed.
    """
    folder = FOLDER / name
    interpreter, stamp = folder / "bin" / "python", folder / "made-from.txt"
    wanted = requirements(name).read_text(encoding="utf-8")
    if stamp.is_file() and stamp.read_text(encoding="utf-8") == wanted:
        return interpreter
    print(f"making {folder.relative_to(FOLDER.parent)}", file=sys.stderr, flush=True)
    _done([sys.executable, "-m", "venv", "--clear", str(folder)])
    pip = [str(interpreter), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    _done([*pip, "-r", str(requirements(name))])
    stamp.write_text(wanted, encoding="utf-8")
    return interpreter


def _done(line: list[str]) -> None:
    try:
        done = subprocess.run(line, capture_output=True, text=True, timeout=LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as problem:
        raise NoEnvironmentError(str(problem)) from problem
    if done.returncode != 0:
        words = [w for w in done.stderr.splitlines() if w.strip() and not w.startswith("WARNING")]
        raise NoEnvironmentError(words[-1] if words else f"ended with {done.returncode}")
