"""The firmware, built once a session, and a host at the simulated board.

Without its compiler and simulator such tests are skipped, or fail where MACROMICRO_AVR is
"required".
"""

from __future__ import annotations

import functools
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from boardsim import avr, mps2  # noqa: E402
from boardsim.bench import Bench  # noqa: E402
from boardsim.wire import Wire  # noqa: E402
from macromicro.control import calibration  # noqa: E402
from macromicro.rig.board.rig import BoardRig  # noqa: E402

_MISSING = avr.missing()
needs_avr = pytest.mark.skipif(
    bool(_MISSING) and os.environ.get("MACROMICRO_AVR") != "required", reason=_MISSING
)
_NO_ARM = mps2.missing()
needs_arm = pytest.mark.skipif(
    bool(_NO_ARM) and os.environ.get("MACROMICRO_AVR") != "required", reason=_NO_ARM
)
needs_c = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler: make compiler")


@functools.cache
def generated() -> Path:
    """The generated C, in a folder of this session's."""
    folder = Path(tempfile.mkdtemp(prefix="firmware"))
    environment = {**os.environ, "PYTHONPATH": f"{ROOT / 'tools'}:{ROOT / 'src'}"}
    command = [sys.executable, "-m", "boardcode", "--out", str(folder)]
    subprocess.run(command, check=True, env=environment)
    return folder


@functools.cache
def elf(board: str = "atmega328p") -> Path:
    """The firmware of a board."""
    folder = generated()
    made = subprocess.run(
        ["make", "-C", str(ROOT / "firmware"), f"OUT={folder}", board],
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    return folder / f"{board}.elf"


@contextmanager
def board(loop: str = "host", flips: float = 0.0, seed: int = 0) -> Iterator[tuple[BoardRig, Wire]]:
    """An opened rig and the line to its simulated board."""
    wire = Wire(Bench(elf(), seed), flips, seed)
    rig = BoardRig("simulated", loop, calibration.default_calibration(), open_port=lambda _: wire)
    with rig:
        yield rig, wire


@contextmanager
def arm(loop: str = "host") -> Iterator[tuple[BoardRig, Wire]]:
    """The same on a Cortex-M4F."""
    wire = Wire(Bench(elf("mps2"), processor=mps2.Mps2))
    rig = BoardRig("simulated", loop, calibration.default_calibration(), open_port=lambda _: wire)
    try:
        with rig:
            yield rig, wire
    finally:
        wire.bench.avr.close()


def until(wire: Wire, over: Callable[[], bool], periods: int) -> int:
    """Let time pass without the host until something is so; how many periods it took."""
    for k in range(periods):
        if over():
            return k
        wire.alone(1)
    raise AssertionError(f"not within {periods} periods")
