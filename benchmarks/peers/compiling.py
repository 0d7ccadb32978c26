"""C sources, compiled on the spot."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

HERE = Path(__file__).resolve().parent
# Never a fused multiply-add: results are compared bit for bit.
PLAIN = ("-O3", "-ffp-contract=off")
NATIVE = (*PLAIN, "-march=native")
# For the compiler's vectoriser: a comparison may be made where its result is not used.


class NoCompilerError(RuntimeError):
    """There is no C compiler, or it could not translate a source."""


def library(source: str, folder: Path, flags: tuple[str, ...] = PLAIN, stem: str = "") -> Path:
    """`source`, a file beside this one, as a shared library in `folder`.

    Raises NoCompilerError, with the compiler's own words if it has any.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        raise NoCompilerError("no C compiler: `cc` is not on the path (Debian: apt install gcc)")
    place = folder / f"{stem or Path(source).stem}.so"
    line = [compiler, *flags, "-shared", "-fPIC", "-o", str(place), str(HERE / source), "-lm"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise NoCompilerError(f"cc {' '.join(flags)} {source}: {done.stderr.strip()[-400:]}")
    return place


def version() -> str:
    """What the compiler calls itself, "" without one."""
    compiler = shutil.which("cc")
    if compiler is None:
        return ""
    done = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False)
    return (done.stdout.splitlines() or [""])[0]
