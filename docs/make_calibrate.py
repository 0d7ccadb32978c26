"""Measures docs/validation/machines.md: calibrations of machines drawn at random, judged by truth.

    python docs/make_calibrate.py [--benches 20] [--workers 1] [--kind ROW]

Laws and calibration know the data sheet, the simulated machine differs from it. Only the judge
reads the true position. `--quick` calibrates one machine of the first row and writes nothing.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import measured_page
import numpy as np

from macromicro.calibration import checking, efforts, measuring, procedure, targets
from macromicro.calibration.procedure import Calibration, Request
from macromicro.calibration.references import INSTRUMENTS, Instrument
from macromicro.machines import composite, compositions, performing, programmes
from macromicro.machines.machine import Machine
from macromicro.runs.setup import Blocks

ROOT = Path(__file__).resolve().parents[1]
SCREW = (ROOT / "examples" / "machines" / "screw.toml").read_text(encoding="utf-8")
PLOTTER = (ROOT / "examples" / "machines" / "xy-plotter.toml").read_text(encoding="utf-8")
TRUTH = Instrument("truth", 0.0, 0.0)
LYING = (
    SCREW.replace('backlash = "4 um"', 'backlash = "50 um"')
    .replace('error = "3 um"', 'error = "30 um"')
    .replace('incline = "90 deg"', 'incline = "0 deg"')
)
WARM = '\n[climate]\nrise = "10 K"\ntime = "120 s"\nexpansion = "12e-6 1/K"\nsensor = 1\n'
COLD = WARM.replace("sensor = 1", "sensor = 0")
BELT = """machine = "axis"
[drive]
kind = "belt"
frequency = "20 Hz"
damping = 0.01
[friction]
coulomb = "3 N"
[encoder]
at = "motor"
"""
LINEAR = """machine = "axis"
[motor]
constant = "20 N*m/A"
[drive]
kind = "linear"
cogging = "4 N"
cogging_period = "24 mm"
[friction]
coulomb = "8 N"
[encoder]
at = "load"
pitch = "0.5 um"
"""
TABLE = """machine = "rotary"
[drive]
ratio = 1.0
error = "20 mdeg"
error_period = "360 deg"
[friction]
coulomb = "0.05 N*m"
[encoder]
at = "motor"
counts = 80000
"""


class Row(NamedTuple):
    name: str
    title: str
    text: str  # settings
    drawn: tuple[str, ...]  # parameters that vary by up to 20 % either way
    target: str
    judge: Callable[[Calibration, Any, int], dict[str, float]]
    unit: str = "um"
    scale: float = 1e6
    reference: str = "laser"


def at_rest(found: Calibration, bench: Any, seed: int) -> dict[str, float]:
    """Greatest true error at rest of 95 of 100 positions, before and after."""
    judged = found.request._replace(reference=TRUTH, seed=seed + 7000)
    machine, settings = found.request.machine, found.request.settings
    off, before_settings = procedure.without_corrections(machine, settings)
    before = procedure.verify(off, before_settings, judged)
    made, after_settings = measuring.ready(machine, found.settings)
    after = procedure.verify(made, after_settings, judged)
    widths = np.array([axis.correction.half_width for axis in found.axes])
    return {
        "before": float(np.quantile(np.abs(before.deviation), 0.95)),
        "after": float(np.quantile(np.abs(after.deviation), 0.95)),
        "half": float(widths.max()),
        "inside": float(np.mean(np.abs(after.deviation) <= widths)),
        **_estimates(found, bench),
    }


def _estimates(found: Calibration, bench: Any) -> dict[str, float]:
    """Whether printed intervals hold the truth, of what the simulated machine has as one number."""
    truths = {
        "periodic error": getattr(getattr(bench, "drive", None), "error", math.nan),
        "expansion": getattr(getattr(bench, "climate", None), "expansion", math.nan),
        "growth after the start": _growth(bench),
    }
    held = {}
    fit = found.axes[0].fit
    period = getattr(getattr(bench, "drive", None), "error_period", math.nan)
    for each in fit.estimates:
        truth = truths.get(each.name, math.nan)
        other = each.name == "periodic error" and abs(fit.model.period / period - 1.0) > 0.01
        if truth > 0.0 and not other:
            held[f"holds {each.name}"] = float(abs(each.value - truth) <= each.half)
    return held


def _growth(bench: Any) -> float:
    climate = getattr(bench, "climate", None)
    return climate.expansion * climate.rise if climate is not None else math.nan


def performed(
    machine: Any, settings: Any, plan: Any, seed: int, bench: Any
) -> dict[str, np.ndarray]:
    """The columns of a run."""
    blocks = Blocks()
    performing.perform(machine, settings, plan, blocks, seed=seed, bench=bench)
    names = [column.name for column in performing.columns(machine)]
    return dict(zip(names, np.concatenate(blocks.blocks, axis=1), strict=True))


def contour(found: Calibration, bench: Any, seed: int) -> dict[str, float]:
    """Greatest true distance from the example circle, before and after."""
    judged = {}
    machine, settings = found.request.machine, found.request.settings
    for name, tree in (("before", settings), ("after", found.settings)):
        made, own = composite.under(machine, tree), tree
        plan = programmes.plan(made, own, programmes.choose(made, own))
        run = performed(made, own, plan, seed, bench)
        legs = [k for k, leg in enumerate(plan.legs) if any(p.curvature for p in leg.pieces)]
        on_arc = np.isin(run["move"], legs) & (run["phase"] == 1)
        worst = 0.0
        for leg in legs:
            arc = next(p for p in plan.legs[leg].pieces if p.curvature)
            rows = on_arc & (run["move"] == leg)
            x, y = run["true_x"][rows] / 1e3, run["true_y"][rows] / 1e3
            radius = 1.0 / arc.curvature  # to the left of the way
            middle = arc.x - radius * arc.uy, arc.y + radius * arc.ux
            away = np.hypot(x - middle[0], y - middle[1])
            worst = max(worst, float(np.max(np.abs(away - 1.0 / abs(arc.curvature)))))
        judged[name] = worst
    return judged | {"half": math.nan, "inside": at_rest(found, bench, seed)["inside"]}


def ripple(found: Calibration, bench: Any, seed: int) -> dict[str, float]:
    """Speed ripple of slow passes that cogging causes, before and after.

    The same passes without cogging show what counts and friction do with the same settings.
    """
    (each,) = found.ripple
    correction = found.settings.correction
    nothing = dict.fromkeys(("effort_up", "effort_down", "effort_waves"), (0.0, 0.0))
    off = correction._replace(**nothing)
    request = found.request
    trees = {
        "before": procedure.without_corrections(request.machine, request.settings),
        "after": procedure.with_corrections(request.machine, found.settings, [off]),
    }
    smooth = bench._replace(drive=bench.drive._replace(cogging=0.0))
    judged = {"half": math.nan, "inside": math.nan}
    for name, (machine, settings) in trees.items():
        assert isinstance(machine, Machine)
        whole = getattr(each, name)
        least = efforts.passes(machine, settings, seed, smooth).ripple
        added = math.sqrt(max(whole**2 - least**2, 0.0))
        judged |= {name: added, f"whole {name}": whole, f"least {name}": least}
    return judged


def reversal(found: Calibration, bench: Any, seed: int) -> dict[str, float]:
    """Time of a 10 mm move until it is within 5 um of its end for good, without and with."""
    times = {}
    for name, way in (("before", 1.0), ("after", -1.0)):
        middle = 0.5 * (found.settings.travel.low + found.settings.travel.high)
        ends = np.array([[middle - 20e-3], [middle], [middle + way * 10e-3]])
        visits = targets.Visits(np.ones(3), np.ones(3), ends)
        machine, settings = measuring.ready(found.request.machine, found.settings)
        plan = targets.plan_visits(machine, settings, visits)
        run = performed(machine, settings, plan, seed, bench)
        last = run["move"] == 2
        off = np.abs(run["true_position"][last] / 1e3 - ends[2, 0]) > 5e-6
        t = run["t"][last]
        times[name] = float(t[np.flatnonzero(off)[-1]] - t[0])
    return times | {"half": math.nan, "inside": math.nan}


FRICTION = ("friction.coulomb", "friction.viscous", "friction.presliding")
SCREWS = ("drive.error", "drive.backlash", "drive.frequency", *FRICTION)
ROWS = (
    Row("screw", "`screw.toml` as shipped, at rest", SCREW, SCREWS, "2 um", at_rest),
    Row("backlash", "50 um backlash, 30 um pitch error, encoder at the motor", LYING, SCREWS,
        "2 um", at_rest),
    Row("warm", "the same, warmed by 10 K, with a sensor", LYING + WARM,
        (*SCREWS, "climate.expansion"), "3 um", at_rest),
    Row("starting", "the same, warmed by 10 K after the start, without a sensor", LYING + COLD,
        (*SCREWS, "climate.expansion", "climate.time"), "3 um", at_rest),
    Row("belt", "belt of 20 Hz, encoder at the motor, friction 3 N", BELT,
        ("drive.frequency", *FRICTION), "20 um, or a warning", at_rest),
    Row("cogging", "speed ripple at 5 mm/s by cogging, RMS", LINEAR,
        ("drive.cogging", *FRICTION), "a fifth", ripple, "um/s"),
    Row("xy", "`xy-plotter.toml`, contour of the example circle", PLOTTER,
        ("hidden.squareness", "x.friction.coulomb", "y.friction.coulomb"), "3 um", contour),
    Row("rotary", "rotary, error once a turn, at rest", TABLE,
        ("drive.error", "friction.coulomb"), "a tenth", at_rest, "mdeg", math.degrees(1e3),
        "autocollimator"),
    Row("reversal", "10 mm move to within 5 um: without, with a reversal", LYING, SCREWS, "1.1",
        reversal, "ms", 1e3),
)  # fmt: skip

NAMED = {row.name: row for row in ROWS}
CHECK = "check"
BENCHES = 20  # published ones


def one(job: tuple[str, int]) -> dict[str, Any]:
    """One machine of a row, or one check: the first as its file says, the others drawn."""
    name, k = job
    found = noticed(k) if name == CHECK else calibrated(NAMED[name], k)
    return {"kind": name, "bench": k, **found}


def calibrated(row: Row, k: int) -> dict[str, Any]:
    """What the row's judge says of a machine."""
    found = procedure.calibrate(request(row, k))
    return row.judge(found, found.request.bench, k)


def request(row: Row, k: int) -> Request:
    """A calibration of a row."""
    machine, settings, bench = drawn(row, k)
    return Request(
        machine, settings, INSTRUMENTS[row.reference], seed=k, bench=bench,
        cogging=row.judge is ripple, reversals=row.judge is contour,
    )  # fmt: skip


def drawn(row: Row, k: int) -> tuple[Any, Any, Any]:
    """A machine, its settings, and those of the simulated machine."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"{row.name}.toml")
        file.write_text(row.text, encoding="utf-8")
        machine, settings = compositions.load(file)
    random = np.random.default_rng([30, k, *row.name.encode()])
    bench = settings
    for path in row.drawn if k else ():
        value = measured_value(settings, path) * random.uniform(0.8, 1.2)
        bench = replaced(bench, path, value)
    return machine, settings, bench


def noticed(k: int) -> dict[str, Any]:
    """Whether `--check` finds a calibration right that is, and wrong in each of three ways."""
    row = NAMED["backlash"]
    found = procedure.calibrate(request(row, k))
    asked = found.request._replace(settings=found.settings, seed=k + 300)
    bench, drive = asked.bench, asked.bench.drive
    correction = found.settings.correction
    turn = 2.0 * math.pi * 1e-3 / correction.period  # the zero is 1 mm off
    a, b, *rest = correction.waves
    waves = (
        a * math.cos(turn) - b * math.sin(turn),
        a * math.sin(turn) + b * math.cos(turn),
        *rest,
    )
    shifted = found.settings._replace(correction=correction._replace(waves=waves))
    wrong = {
        "another stage": asked._replace(bench=drawn(row, k + 50)[2]),
        "a shifted zero": asked._replace(settings=shifted),
        "a worn screw": asked._replace(
            bench=bench._replace(drive=drive._replace(backlash=1.5 * drive.backlash))
        ),
    }
    found_out = {way: not checking.check(each).axes[0].holds for way, each in wrong.items()}
    return {"right": checking.check(asked).axes[0].holds, "noticed": found_out}


def measured_value(tree: Any, path: str) -> float:
    for name in path.split("."):
        tree = getattr(tree, name)
    return float(tree)


def replaced(tree: Any, path: str, value: float) -> Any:
    """A tree with another value, and nothing that follows from it: laws know the sheet."""
    name, _, rest = path.partition(".")
    return tree._replace(**{name: replaced(getattr(tree, name), rest, value) if rest else value})


def rows(found: list[dict[str, Any]]) -> str:
    """The machines' errors before and after, of each row that was measured."""
    head = ["machine", "before", "after, median", "after, 95 % of machines", "target",
            "positions within the printed half width"]  # fmt: skip
    lines = []
    for row in ROWS:
        own = [each for each in found if each["kind"] == row.name]
        if not own:
            continue
        before, after, inside = (
            np.array([e[key] for e in own]) for key in ("before", "after", "inside")
        )
        sizes = (np.median(before), np.median(after), np.quantile(after, 0.95))
        lines.append([
            row.title,
            *(f"{row.scale * size:.3g} {row.unit}" for size in sizes),
            row.target,
            "" if np.isnan(inside).all() else f"{100 * np.nanmean(inside):.0f} %",
        ])  # fmt: skip
    return measured_page.table(head, lines)


def rippled(found: list[dict[str, Any]]) -> str:
    """What the encoder's counts have of the speed ripple."""
    names = ("whole before", "least before", "whole after", "least after")
    shown = [f"{1e6 * np.median([each[name] for each in found]):.3g} um/s" for name in names]
    return (
        "\nThe row of the speed ripple, by the encoder over 0.1 s, shows what cogging adds. The "
        f"total is {shown[0]} before and {shown[2]} after the calibration. Without any cogging "
        f"it is {shown[1]} and {shown[3]}, from counts of the encoder.\n"
    )


def held(found: list[dict[str, Any]]) -> str:
    """How many printed intervals contain the truth."""
    kept: dict[str, list[float]] = {}
    for each in found:
        for key, value in each.items():
            if key.startswith("holds "):
                kept.setdefault(key.removeprefix("holds "), []).append(value)
    lines = [(name, f"{sum(v):.0f} of {len(v)}") for name, v in sorted(kept.items())]
    return "\n" + measured_page.table(["printed interval", "contains the true value"], lines)


def check_table(checks: list[dict[str, Any]]) -> str:
    """How many right and wrong calibrations `--check` tells apart."""
    right = sum(each["right"] for each in checks)
    lines = [("the machine that was calibrated", f"{right} of {len(checks)} pass")]
    for way in checks[0]["noticed"]:
        found = sum(each["noticed"][way] for each in checks)
        lines.append((way, f"{found} of {len(checks)} are detected"))
    return "\n" + measured_page.table(["`--check` of", "result"], lines)


def tables(every: list[dict[str, Any]]) -> dict[str, str]:
    """All of them, of what was measured."""
    of_ripple = [each for each in every if "whole after" in each]
    checks = [each for each in every if each["kind"] == CHECK]
    text = rows(every)
    text += rippled(of_ripple) if of_ripple else ""
    text += held(every)
    text += check_table(checks) if checks else ""
    return {"calibrations": text}


def jobs(chosen: argparse.Namespace) -> list[Any]:
    """Every machine to calibrate, then the checks."""
    if chosen.quick:
        return [(ROWS[0].name, 1)]
    number = measured_page.count(chosen, BENCHES)
    return [(name, k) for name in (*NAMED, CHECK) for k in range(number)]


STUDY = measured_page.Study(
    measured_page.VALIDATION / "machines.md",
    measured_page.RAW / "calibrations.json",
    jobs,
    one,
    tables,
)

if __name__ == "__main__":
    measured_page.main(__doc__, STUDY)
