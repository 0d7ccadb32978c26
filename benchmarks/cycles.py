"""Cycles that a period of each exported law takes on an AVR, its flash and its RAM.

    python benchmarks/cycles.py

compiles the exported C (`--float`) with avr-gcc -O2 and runs it in simavr over readings of the
law's own run. The ATmega328P of an Arduino Uno is taken where the law fits; else the ATmega1284P,
the same core with 128 KiB of flash and 16 KiB of RAM. Cycles are the same on both.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from figures import Line, few

from macromicro import api
from macromicro.arrays import Array
from macromicro.control import correction
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import correcting, machine
from macromicro.machines.tree import gains
from macromicro.settings import Settings

HERE = Path(__file__).resolve().parent
AVR = HERE / "avr"
MCUS = ("atmega328p", "atmega1284p")
CLOCK = 16e6  # Hz
PERIODS = 500
MACRO, MICRO = 1, 3  # phases in which either stage's law drives


class Law(NamedTuple):
    """A law of `macromicro export`, and the stage whose readings it steps over (counts, or nm)."""

    law: str
    stage: int


LAWS = {  # how the C of each is called is in avr/
    "pd_tuned": Law("pd-tuned", MACRO),
    "micro": Law("pi-antiwindup", MICRO),
    "pid-heat": Law("pid-heat", MICRO),
    "terminal": Law("terminal", MACRO),
    "inverse": Law("inverse", MICRO),
}
CORRECTED = "axis.law, corrected"


class Found(NamedTuple):
    """Cycles, and bytes of the law alone: what they are above a programme without it."""

    mcu: str
    mean: int
    most: int
    flash: int
    ram: int
    stack: int


def missing() -> str:
    """What this machine lacks, "" if nothing."""
    for tool in ("avr-gcc", "avr-size", "simavr"):
        if shutil.which(tool) is None:
            return f"no {tool}: make avr"
    return ""


def readings(law: Law) -> tuple[Array, Array, float]:
    """Aims and readings of the law's first move as whole numbers, and what one of them is."""
    settings = Settings()
    chosen = settings._replace(controller=settings.controller.joined(law.law, "law"))
    run = api.run("fast", settings=chosen)
    first = int(np.argmax(np.asarray(run["phase"]) == law.stage))
    part = slice(first, first + PERIODS)
    if law.stage == MACRO:
        # The error is in counts for the thesis' laws, the place in m for the others.
        size = 1.0 if law.law == "pd-tuned" else settings.sensors.encoder.pitch
        return run["macro_reference"][part], run["macro_position"][part], size
    nm = 1e6  # of the recording's mm
    return run["micro_reference"][part] * nm, run["hall_position"][part] * nm, 1e-9


def _replay(aims: Array, places: Array, size: float) -> str:
    columns = "\n".join(
        f"static const int32_t {name}[PERIODS] PROGMEM = {{{', '.join(map(str, whole))}}};"
        for name, values in (("aims", aims), ("places", places))
        for whole in [np.rint(values).astype(int).tolist()]
    )
    return f"#define PERIODS {PERIODS}\n#define SCALE {size:.9e}f\n{columns}\n"


def _size(elf: Path) -> tuple[int, int]:
    """Flash and static RAM."""
    told = subprocess.run(["avr-size", elf], check=True, capture_output=True, text=True).stdout
    text, data, bss = map(int, told.splitlines()[1].split()[:3])
    return text + data, data + bss


def _built(folder: Path, mcu: str, sources: list[Path], calls: str) -> Path | None:
    """The programme with the calls of a header of avr/; None if it does not fit."""
    elf = folder / f"{calls}-{mcu}.elf"
    command = [
        *("avr-gcc", f"-mmcu={mcu}", "-std=gnu99", "-O2", "-ffp-contract=off"),
        *("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections"),
        *("-I", str(folder), "-I", str(AVR), f'-DCALLS="{calls}.h"'),
        *(str(AVR / "cycles.c"), *map(str, sources), "-o", str(elf), "-lm"),
    ]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode == 0:
        return elf
    if re.search("not within region|will not fit|overflowed", done.stderr):
        return None
    raise RuntimeError(done.stderr)


def measure(name: str) -> Found:
    """One law of `LAWS`, in the smallest of `MCUS` that has room for it."""
    with TemporaryDirectory() as made:
        folder, calls = Path(made), name.replace("-", "_")
        _command("export", "c", f"two_stage.{name}", "--float", "--out", made)
        sources = [folder / f"two_stage_{calls}.c", AVR / "erff.c"]
        return _smallest(folder, sources, calls, _replay(*readings(LAWS[name])))[0]


def _smallest(
    folder: Path, sources: list[Path], calls: str, replay: str
) -> tuple[Found, list[str]]:
    """Figures of the smallest of `MCUS` that has room for a programme, and what it told."""
    (folder / "replay.h").write_text(replay, encoding="utf-8")
    for mcu in MCUS:
        bare = _built(folder, mcu, [], "nothing")
        assert bare is not None
        base, (none, _, own), _ = _size(bare), *_ran(bare, mcu)
        elf = _built(folder, mcu, sources, calls)
        if elf is None:
            continue
        size = _size(elf)
        (mean, most, stack), told = _ran(elf, mcu)
        # A processor whose stack ran into its variables counts nothing that is true.
        if size[1] + stack <= (2048 if mcu == MCUS[0] else 16384) - 16:
            ram = size[1] - base[1]
            return Found(mcu, mean - none, most - none, size[0] - base[0], ram, stack - own), told
    raise RuntimeError(f"{calls} fits none of {', '.join(MCUS)}")


class Replay(NamedTuple):
    """The law of a calibrated axis over the set points and readings of its own run."""

    found: Found
    efforts: Array  # V, of each period on the AVR
    expected: Array  # the same by Python


def corrected() -> Replay:
    """The law and the correction of a stage that was calibrated with a dial, in one programme."""
    examples = HERE.parent / "examples"
    with TemporaryDirectory() as made:
        folder, dial = Path(made), Path(made) / "dial"
        readings = examples / "calibration" / "dial.csv"
        screw = examples / "machines" / "screw.toml"
        _command("calibrate", "--config", screw, "--readings", readings, "--out", dial)
        settings = dial / "calibrated.toml"
        for unit in ("axis.law", "axis.correction"):
            _command("export", "c", unit, "--float", "--config", settings, "--out", made)
        one, tree = machine.load(settings)
        run = api.run(settings)
        aims, places = (1e6 * run[name][:PERIODS] for name in ("target", "reading"))  # nm
        sources = [folder / "axis_law.c", folder / "axis_correction.c", AVR / "correction.c"]
        found, told = _smallest(folder, sources, "corrected", _replay(aims, places, 1e-9))
    expected = _expected(one, tree, np.rint(aims) * 1e-9, np.rint(places) * 1e-9)
    return Replay(found, np.array(told, float) * 1e-6, expected)


def _command(*words: object) -> None:
    command = [sys.executable, "-m", "macromicro", *map(str, words), "--overwrite"]
    subprocess.run(command, check=True, capture_output=True, timeout=300)


def _expected(one: Any, tree: Any, aims: Array, places: Array) -> Array:
    """The efforts by the kernels, interpreted."""
    tables, flank, efforts = correcting.tables(tree), correction.Flank(), []
    law, gained = one.law, gains(tree)
    memory = law.start(gained, Sample(0.0, places[0]))
    for k, (aim, place) in enumerate(zip(aims, places, strict=True)):
        t = k * 1e-3
        wanted = Target(aim, 0.0, 0.0, math.inf)
        flank, target = correction.aimed(tables, flank, wanted, (aim,), (0.0,), 20.0, t)
        push = correction.effort(tables, flank, wanted, target, place, t)
        still = Target(target.position, 0.0, 0.0, math.inf)
        memory, effort = law.step(gained, memory, still, Sample(t, place), 1e-3)
        efforts.append(effort + push)
    return np.array(efforts)


def _ran(elf: Path, mcu: str) -> tuple[tuple[int, int, int], list[str]]:
    """Mean and most cycles of a period, bytes of stack; and efforts in microvolts, if told."""
    command = ["simavr", "-m", mcu, "-f", str(int(CLOCK)), str(elf)]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300)
    told = re.search(r"(\d+) (\d+) (\d+) (\d+)", done.stdout + done.stderr)
    if told is None:
        raise RuntimeError(f"simavr: {done.stdout}{done.stderr}")
    if int(told[4]):
        raise RuntimeError(f"{elf.stem}: {told[4]} periods without a finite effort")
    efforts = re.findall(r"\x1b\[32m(-?\d+)\.\n", done.stdout + done.stderr)
    return (int(told[1]), int(told[2]), int(told[3])), efforts


def lines() -> list[Line]:
    """One for each law, as the benchmark's table has them."""
    lack = missing()
    if lack:
        return [Line("cycles on an AVR", "", None, "cycles", f"not measured, {lack}")]
    found = []
    for name in [*LAWS, CORRECTED][: few(len(LAWS) + 1)]:
        one = corrected().found if name == CORRECTED else measure(name)
        note = f"at most {one.most} ({1e3 * one.most / CLOCK:.2f} ms at 16 MHz), {one.flash} B "
        note += f"flash, {one.ram} B RAM and {one.stack} B stack, {one.mcu}"
        found.append(Line(f"export {name}, float", "", float(one.mean), "cycles", note))
    return found


if __name__ == "__main__":
    lack = missing()
    if lack:
        sys.exit(lack)
    for name in LAWS:
        print(name, measure(name), flush=True)
    print(CORRECTED, corrected().found)
