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
from figures import few

from macromicro import api
from macromicro.arrays import Array
from macromicro.control import correction
from macromicro.control.stage_law import Sample, Target
from macromicro.machines import correcting, machine
from macromicro.machines.tree import gains
from macromicro.settings import Settings

HERE = Path(__file__).resolve().parent
MCUS = ("atmega328p", "atmega1284p")
CLOCK = 16e6  # Hz
PERIODS = 500
MACRO, MICRO = 1, 3  # phases in which either stage's law drives
BASE = "base"
# avr-libc has no erff; this is Abramowitz and Stegun's 7.1.26, good to 1.5e-7.
ERROR = """
#include <math.h>
float erff(float x)
{
    const float a = fabsf(x), t = 1.0f / (1.0f + 0.3275911f * a);
    const float s = ((((1.061405429f * t - 1.453152027f) * t + 1.421413741f) * t - 0.284496736f)
                     * t + 0.254829592f) * t;
    return copysignf(1.0f - s * expf(-a * a), x);
}
"""


class Law(NamedTuple):
    """A law of `macromicro export`, and how its C is called (units: counts, or nm of a run)."""

    law: str
    stage: int
    start: str
    step: str


_FULL = """const StageLawTarget target = {(a), 0.0f, 0.0f}; \\
    const StageLawSample sample = {(t), (x)}; \\
    """
LAWS = {
    "pd_tuned": Law(
        "pd-tuned",
        MACRO,
        "PdMemory state = two_stage_pd_tuned_start(0.0f); (void)(x)",
        "const TwoStagePdTunedStepOut out = two_stage_pd_tuned_step(&two_stage_pd_tuned_gains, "
        "&state, (a) - (x), 0.001f); state = out.memory; effort = out.effort;",
    ),
    "micro": Law(
        "pi-antiwindup",
        MICRO,
        "float state = 0.0f; (void)(x)",
        "const TwoStageMicroStepOut out = two_stage_micro_step(&two_stage_micro_gains, "
        "state, (a) - (x), 0.001f); state = out.integral; effort = out.effort;",
    ),
    "pid-heat": Law(
        "pid-heat",
        MICRO,
        "const StageLawSample begun = {0.0f, (x)}; "
        "PidHeatMemory state = two_stage_pid_heat_start(&two_stage_pid_heat_gains, &begun)",
        _FULL + "const TwoStagePidHeatStepOut out = two_stage_pid_heat_step("
        "&two_stage_pid_heat_gains, &state, &target, &sample, 0.001f); "
        "state = out.memory; effort = out.effort;",
    ),
    "terminal": Law(
        "terminal",
        MACRO,
        "const StageLawSample begun = {0.0f, (x)}; "
        "LawMemory state = two_stage_terminal_start(&two_stage_terminal_gains, &begun)",
        _FULL + "const TwoStageTerminalStepOut out = two_stage_terminal_step("
        "&two_stage_terminal_gains, &state, &target, &sample, 0.001f); "
        "state = out.memory; effort = out.effort;",
    ),
    "inverse": Law(
        "inverse",
        MICRO,
        "static LawStateStore store; LawState state; "
        "two_stage_inverse_begin(&state, &store); (void)(x)",
        _FULL + "const TwoStageInverseStepOut out = two_stage_inverse_step("
        "&two_stage_inverse_gains, &state, &target, &sample, 0.001f); "
        "state = out.state; effort = out.effort;",
    ),
}


# The law of a calibrated axis goes on in readings; each unit is a translation unit of its own.
CORRECTED = "axis.law, corrected"
_SHIM = """
#include <math.h>
#include "axis_correction.h"
static CorrectionFlank flank;
static StageLawTarget wanted, target;
void begin(void) { axis_correction_begin(&flank); }
float reading_at(float place, float t)
{
    wanted = (StageLawTarget){place, 0.0f, 0.0f, INFINITY};
    const float alone[] = {place}, still[] = {0.0f};
    const AxisCorrectionAimedOut out = axis_correction_aimed(
        &axis_correction_tables, &flank, &wanted, alone, still, 20.0f, t);
    flank = out.flank;
    target = out.target;
    return target.position;
}
float push_at(float reading, float t)
{
    return axis_correction_effort(
        &axis_correction_tables, &flank, &wanted, &target, reading, t);
}
"""
_CALLS = """
#include "axis_law.h"
#define EFFORTS
void begin(void);
float reading_at(float place, float t), push_at(float reading, float t);
#define START(x) begin(); const StageLawSample begun = {0.0f, (x)}; \\
    CascadeMemory state = axis_law_start(&axis_law_gains, &begun)
#define STEP(a, x, t) do { \\
    const StageLawTarget wanted = {reading_at((a), (t)), 0.0f, 0.0f, INFINITY}; \\
    const StageLawSample sample = {(t), (x)}; \\
    const AxisLawStepOut out = axis_law_step(&axis_law_gains, &state, &wanted, &sample, 0.001f); \\
    state = out.memory; effort = out.effort + push_at((x), (t)); } while (0)
"""


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
    """The program; None if it does not fit."""
    calls_file, elf = folder / "replay.h", folder / f"{mcu}.elf"
    calls_file.write_text(calls, encoding="utf-8")
    command = [
        *("avr-gcc", f"-mmcu={mcu}", "-std=gnu99", "-O2", "-ffp-contract=off"),
        *("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-I", str(folder)),
        *(str(HERE / "cycles.c"), *map(str, sources), "-o", str(elf), "-lm"),
    ]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode == 0:
        return elf
    if re.search("not within region|will not fit|overflowed", done.stderr):
        return None
    raise RuntimeError(done.stderr)


def measure(name: str) -> Found:
    """One law of `LAWS`, in the smallest of `MCUS` that has room for it."""
    law = LAWS[name]
    with TemporaryDirectory() as made:
        folder = Path(made)
        api_name = f"two_stage.{name}"
        _command("export", "c", api_name, "--float", "--out", made)
        unit = f"two_stage_{name.replace('-', '_')}"
        (folder / "error.c").write_text(ERROR, encoding="utf-8")
        sources = [folder / f"{unit}.c", folder / "error.c"]
        replay = _replay(*readings(law))
        whole = f'#include "{unit}.h"\n{replay}#define START(x) {law.start}\n'
        whole += f"#define STEP(a, x, t) do {{ {law.step} }} while (0)\n"
        return _smallest(name, folder, sources, whole, replay)[0]


def _smallest(
    name: str, folder: Path, sources: list[Path], whole: str, replay: str
) -> tuple[Found, list[str]]:
    """Figures of the smallest of `MCUS` that has room for a programme, and what it told."""
    empty = f"{replay}#define START(x) (void)(x)\n"
    empty += "#define STEP(a, x, t) effort = (a) - (x) + (t)\n"
    for mcu in MCUS:
        bare = _built(folder, mcu, [], empty)
        assert bare is not None
        base, (none, _, own), _ = _size(bare), *_ran(bare, mcu)
        elf = _built(folder, mcu, sources, whole)
        if elf is None:
            continue
        size = _size(elf)
        (mean, most, stack), told = _ran(elf, mcu)
        # A processor whose stack ran into its variables counts nothing that is true.
        if size[1] + stack <= (2048 if mcu == MCUS[0] else 16384) - 16:
            ram = size[1] - base[1]
            return Found(mcu, mean - none, most - none, size[0] - base[0], ram, stack - own), told
    raise RuntimeError(f"{name} fits none of {', '.join(MCUS)}")


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
        (folder / "shim.c").write_text(_SHIM, encoding="utf-8")
        sources = [folder / name for name in ("axis_law.c", "axis_correction.c", "shim.c")]
        replay = _replay(aims, places, 1e-9)
        found, told = _smallest(CORRECTED, folder, sources, _CALLS + replay, replay)
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


def lines(line: Any) -> list[Any]:
    """One for each law, as the benchmark's table has them."""
    lack = missing()
    if lack:
        return [line("cycles on an AVR", "", None, "cycles", f"not measured, {lack}")]
    found = []
    for name in [*LAWS, CORRECTED][: few(len(LAWS) + 1)]:
        one = corrected().found if name == CORRECTED else measure(name)
        note = f"at most {one.most} ({1e3 * one.most / CLOCK:.2f} ms at 16 MHz), {one.flash} B "
        note += f"flash, {one.ram} B RAM and {one.stack} B stack, {one.mcu}"
        found.append(line(f"export {name}, float", "", float(one.mean), "cycles", note))
    return found


if __name__ == "__main__":
    lack = missing()
    if lack:
        sys.exit(lack)
    for name in LAWS:
        print(name, measure(name), flush=True)
    print(CORRECTED, corrected().found)
