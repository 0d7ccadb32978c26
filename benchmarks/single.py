"""Speed of one: the whole bench, the common job and Preisach beside C, a new process."""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import parts
from figures import Line, few, timed

from macromicro import loop, simulate
from macromicro import programme as programmes
from macromicro.kernel import compiled
from macromicro.loop import PERIOD
from macromicro.plant.bench import NOISES
from macromicro.recorded import COLUMNS, ROWS
from macromicro.recording import Recorder
from macromicro.rig.twin import noise_source
from macromicro.settings import Settings

LIMITS = programmes.Limits(0.0, 2800.0, 0.0, 3.9e-3, 14000.0)
REAL_TIME = 1e9 * PERIOD  # ns
FIRST = "import macromicro; macromicro.run('thesis')"
TOLD = f"{FIRST}; import time; print(time.time(), flush=True)"


def whole_bench(repeats: int = 9) -> Line:
    """Bench, sensors, supervisor, guard and noise through the thesis' test, nothing recorded."""
    what = programmes.load(programmes.find("thesis"), LIMITS)
    settings, block = Settings(), np.empty((ROWS, simulate.CHUNK))
    advance = compiled(loop.rollout)
    periods = 0

    def run() -> None:
        nonlocal periods
        rolled = simulate.prepare(settings, what)
        state, random, written = rolled.run, noise_source(0), simulate.CHUNK
        while written == simulate.CHUNK:
            noise = random.standard_normal((simulate.CHUNK, NOISES))
            state, written = advance(
                rolled.plant,
                rolled.control,
                rolled.watchdog,
                rolled.plan,
                state,
                noise,
                block,
                PERIOD,
            )
        periods = state.tick

    taken = timed(run, repeats)
    remark = f"{1e9 * taken / periods:.0f} ns a period of 1 ms"
    return Line(
        "whole bench with controllers", "at least 2000", periods * PERIOD / taken, "x real", remark
    )


def integrated(cycles: int, repeats: int) -> tuple[float, float]:
    """Wall time [s] and simulated time [s] of the integrated test, recorded to a file."""
    what = programmes.load(programmes.find("thesis"), LIMITS).repeated(cycles)
    simulated = 0.0
    with tempfile.TemporaryDirectory() as folder:

        def run() -> None:
            nonlocal simulated
            place = Path(folder) / "recording.h5"
            rows = round(95.0 * cycles / PERIOD)
            with Recorder(place, COLUMNS, rows, PERIOD, {}, overwrite=True) as recorder:
                simulated = simulate.simulate(Settings(), what, recorder).simulated

        return timed(run, repeats), simulated


def bench() -> list[Line]:
    """The bench as a whole and in parts."""
    one, simulated = integrated(1, 7)
    ten, long = integrated(10, 5)
    found = [
        whole_bench(),
        Line("the same, recorded, 1 cycle", "at least 500", simulated / one, "x real"),
        Line("the same, recorded, 10 cycles", "at least 500", long / ten, "x real"),
        Line("ten cycles, already compiled", "at most 5", ten, "s", f"{long:.0f} s simulated"),
    ]
    per = parts.measure()
    in_c = parts.macro_in_c()
    for name, ns in per.items():
        ratio = ns / in_c if in_c is not None and name == "macro physics, moving" else None
        found.append(Line(name, "", ns, "ns", "", ratio))
    return found


def common_job() -> list[Line]:
    """The thesis' tuned loop for 10 s, and Preisach, beside the same in C, turn by turn."""
    import compiling  # of the peers, as the others
    import job
    import loops
    import preisach_rate

    with tempfile.TemporaryDirectory() as folder:
        try:
            rows = loops.measure(job.default(), Path(folder), few(300))
            rates = preisach_rate.measure(Path(folder), few(11))
        except compiling.NoCompilerError as error:
            return [Line("the common job beside C", "at most 1.1 to C", None, "us", str(error))]
    found = [
        Line(
            f"common job, {row['what']}",
            "at most 1.1 to C" if row["what"].startswith("macromicro") else "",
            1e6 * row["least"],
            "us",
            f"{row['ratio_to_native']:.2f} to C for this processor; "
            f"off by {row['counts_off']:g} counts",
            row["ratio_of_least"],
        )
        for row in rows
    ]
    for rate in rates:
        ratio = rate.c[1] / rate.run[1]
        target = "at least 3e7; at most 1.5 to C"
        remark = f"kernel alone {rate.c[1] / rate.kernel[1]:.2f} to C"
        name = f"Preisach, {rate.signal} input"
        found.append(Line(name, target, rate.run[1], "samples/s", remark, ratio))
    return found


def process(*line: str, own: bool = False) -> float | None:
    """Least wall time [s] of a new Python with these arguments, or until the time of day that it
    prints of its own; None if it fails."""
    found = [math.inf]
    for _ in range(few(5)):
        start = time.time()
        done = subprocess.run([sys.executable, *line], capture_output=True, check=False)
        if done.returncode:
            return None
        found.append((float(done.stdout) if own else time.time()) - start)
    return min(found)


def cold() -> list[Line]:
    """A new process, the compiler's cache warm."""
    with tempfile.TemporaryDirectory() as folder:
        again = process(
            "-m", "macromicro", "run", "--out", str(Path(folder) / "run"), "--overwrite"
        )
    return [
        Line("macromicro --help", "below 0.3", process("-m", "macromicro", "--help"), "s"),
        Line("new process to first result", "below 1", process("-c", TOLD, own=True), "s", FIRST),
        Line("the same, the process ended too", "", process("-c", FIRST), "s"),
        Line("macromicro run, figures and page", "below 4", again, "s"),
    ]


def lines() -> list[Line]:
    return [*bench(), *common_job(), *cold()]
