"""Measures the micro-stage of docs/validation/beyond.md: the law `inverse` and the thesis' PI.

    python docs/make_beyond_micro.py --benches 20

Each bench is drawn from `uncertainty`, its kiln's cycles and heatings are identified as `identify
actuator` does, and both laws make the same moves by the Hall sensor. Only the judge reads the
bench: the true place, and the limit from the same state.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import beyond
import measured_page
import numpy as np
from beyond import GROUPS, Quantity

from macromicro import hall_table, loop, recorded, simulate
from macromicro.control.inverse.model import Inverse
from macromicro.design import fine_limits
from macromicro.drawing.files import encode
from macromicro.drawing.style import BLUE, GREEN, ORANGE, finish, new
from macromicro.errors import InputError
from macromicro.identify import kiln as kiln_fit
from macromicro.identify import wire_table
from macromicro.kernel import compiled
from macromicro.lab import learning
from macromicro.nominal import PERIOD
from macromicro.plant import bench
from macromicro.plant.bench import NOISES
from macromicro.programme import Programme, load, travel
from macromicro.recording import Recording
from macromicro.rig.codes import OK
from macromicro.rig.twin import noise_source
from macromicro.runs import programmed
from macromicro.settings import Settings
from macromicro.thesis import kiln_bench
from macromicro.thesis.chapter5 import electrothermal_runs, kiln_runs
from macromicro.uncertainty import table

LAWS = ("pi-antiwindup", "inverse")
MIDDLE = "pid-heat"  # needs no identification
SEED = 7  # of the published benches
# mm: long and short ways, both directions.
PLACES = (
    *(1.0, 2.0, 3.0, 2.0, 1.0, 1.5, 1.45, 1.5, 2.5, 2.4, 2.5, 3.5, 0.5, 3.0, 1.0, 2.0, 1.9, 2.0),
    *(2.01, 2.0, 0.3, 2.7),
)
HOLD = 3.0  # s
SHORT = 0.101  # mm
NEAR, CLOSE = 10e-3, 2e-3  # mm
SINES = ((0.5, 0.2), (0.5, 0.5))  # mm, Hz
SECONDS = 14.0
TABLE = (
    Quantity("RMS in a hold", "um", 2),
    Quantity("contraction to 10 um by the limit", "", 3),
    Quantity("extension to 10 um by the limit", "", 3),
    Quantity("steps of at most 0.1 mm beyond the limit", "ms", 0),
    Quantity("time to 2 um beyond the limit to 10 um", "ms", 0),
    Quantity("over the target", "um", 1),
    Quantity("sine of 0.5 mm at 0.2 Hz, RMS", "um", 1),
    Quantity("sine of 0.5 mm at 0.5 Hz, RMS", "um", 1),
    Quantity("the same at 0.2 Hz, learned in 10 runs", "um", 2),
    Quantity("the same at 0.5 Hz, learned in 10 runs", "um", 2),
)


def identified(settings: Settings, seed: int) -> wire_table.LawFit:
    """As `collect kiln`, `collect actuator` and `identify actuator` do."""
    machine = bench.prepare(settings.bench, settings.sensors)
    oven = kiln_bench.prepare(kiln_bench.with_bench(settings.bench))
    room = settings.bench.thermal.ambient  # a thermometer tells
    turns = kiln_runs.cycles(cold=max(kiln_runs.COLD, room + 2.0))
    cycles = kiln_runs.run(oven, turns, seed)
    curves = kiln_fit.fod_table([cycles], cold=max(35.0, room + 6.0))
    return wire_table.for_law(curves, electrothermal_runs.for_actuator(machine, seed), room)


def under(settings: Settings, law: str, gains: Inverse | None) -> Settings:
    """The bench under a law."""
    tree = beyond.under(settings, law)
    if gains is None:
        return tree
    return tree._replace(controller=tree.controller._replace(fine=gains))


def moved(
    settings: Settings, folder: Path, ways: Sequence[float] = PLACES, hold: float = HOLD
) -> list[dict[str, Any]]:
    """Every move of `ways`, judged by the true place, with the limit from the same state.

    A limit that is not to be had, of a room too warm for the place, is None.
    """
    path = folder / "moves.toml"
    places = ", ".join(f'"{x} mm"' for x in ways)
    path.write_text(f'[[moves]]\nmicro = [{places}]\nhold = "{hold} s"\n')
    rolled = simulate.prepare(
        settings, load(path, travel.limits(settings.travel, settings.sensors.encoder.pitch))
    )
    advance, rows = compiled(loop.rollout), recorded.columns(rolled.control)
    at = [c.name for c in rows].index("true_micro")
    run, random, found, before = rolled.run, noise_source(1), [], 0.0
    n = round(hold / PERIOD)
    for goal in measured_page.few(tuple(ways)):
        least = limited(rolled.plant, run.bench, goal)
        noise, out = random.standard_normal((n, NOISES)), np.empty((len(rows), n))
        run, written = advance(*rolled[:4], run, noise, out, PERIOD)
        if run.watch.fault != OK or written < n - 1:
            raise RuntimeError(f"{settings.controller.micro_law}: stopped at {goal} mm")
        off = out[at, :written] - goal
        sign = math.copysign(1.0, goal - before)
        found.append(
            {
                "from": before,
                "to": goal,
                "least": least,
                "near": beyond.last(np.abs(off) > NEAR) * PERIOD,
                "close": beyond.last(np.abs(off) > CLOSE) * PERIOD,
                "rms": 1e3 * float(np.sqrt(np.mean(off[-1000:] ** 2))),
                "over": 1e3 * max(float((sign * off).max()), 0.0),
            }
        )
        before = goal
    return found


def limited(plant: bench.Plant, state: bench.State, goal: float) -> float | None:
    """Least time to a place (mm), s; None where no input comes there in a minute."""
    try:
        return fine_limits.quickest(plant, state, 1e-3 * goal, 1e-3 * NEAR)
    except InputError:
        return None


def sine(a: float, f: float, settings: Settings, folder: Path) -> Programme:
    """A sine about 2 mm, for 14 s, from 3 s on."""
    t = np.arange(0.0, SECONDS, PERIOD)
    x = 2.0 - a * np.cos(2.0 * np.pi * f * np.maximum(t - 3.0, 0.0))
    path = beyond.ways(list(zip(t, x, strict=True)), "micro_mm", folder / "sine.csv")
    return load(path, travel.limits(settings.travel, settings.sensors.encoder.pitch))


def off(programme: Programme, settings: Settings, seed: int = 2) -> float:
    """RMS of the true place off the reference, um, from 4 s on."""
    rolled = simulate.prepare(settings, programme)
    columns = recorded.columns(rolled.control)
    names = [c.name for c in columns]
    count = round(SECONDS / PERIOD)
    out = np.empty((len(columns), count))
    noise = noise_source(seed).standard_normal((count, NOISES))
    _, n = compiled(loop.rollout)(*rolled, noise, out, PERIOD)
    error = out[names.index("true_micro"), :n] - out[names.index("micro_reference"), :n]
    return 1e3 * float(np.sqrt(np.mean(error[4000 : n - 10] ** 2)))


def tracked(settings: Settings, folder: Path) -> list[float]:
    """What each of `SINES` is off by, um."""
    return [off(sine(a, f, settings, folder), settings) for a, f in measured_page.few(SINES)]


def learned(settings: Settings, folder: Path) -> list[float]:
    """The same after `macromicro learn`; the runs that it is judged by were not learned from."""
    limits = travel.limits(settings.travel, settings.sensors.encoder.pitch)
    found = []
    for a, f in measured_page.few(SINES):

        def run(what: Programme, k: int) -> Recording:
            return programmed.record(what, settings, seed=k).recording

        programme = sine(a, f, settings, folder)
        best = learning.learn(programme, run, learning.sensor_lag(settings), limits).programme
        found.append(float(np.mean([off(best, settings, 100 + k) for k in range(3)])))
    return found


def one(job: tuple[str, int, Settings, str]) -> dict[str, Any]:
    """One bench: identified or not, moved by both laws."""
    kind, k, settings, where = job
    folder = beyond.folder(where, "micro", kind, k)
    found: dict[str, Any] = {"kind": kind, "bench": k}
    try:
        hall_table.of_bench(settings)
        gains = None
        if kind == GROUPS[0]:
            fit = identified(settings, 100 * k)
            gains = fit.gains
            found |= {"values": fit.fit.values, "lag": gains.lag, "sensor": fit.sensor}
            found["rms"] = 1e3 * fit.fit.rms
        for law in LAWS if kind == GROUPS[0] else (*LAWS, MIDDLE):
            tree = under(settings, law, gains if law == "inverse" else None)
            found[law] = {"moves": moved(tree, folder), "tracking": tracked(tree, folder)}
            found[law]["learned"] = learned(tree, folder)
    except (InputError, RuntimeError) as error:
        found["refused"] = str(error)
    beyond.said(kind, k, found.get("refused", ""))
    return found


def rows(every: list[dict[str, Any]], law: str) -> dict[str, list[float]]:
    """By quantity, one value for each move (or bench) that it is judged on."""
    found: dict[str, list[float]] = {each.name: [] for each in TABLE}
    for b in every:
        for m in b[law]["moves"]:
            way = m["to"] - m["from"]
            if m["least"] is None:
                continue  # nobody can be there
            found["RMS in a hold"].append(m["rms"])
            found["over the target"].append(m["over"])
            found["time to 2 um beyond the limit to 10 um"].append(1e3 * (m["close"] - m["least"]))
            if abs(way) <= SHORT:
                late = 1e3 * (m["near"] - m["least"])
                found["steps of at most 0.1 mm beyond the limit"].append(late)
            else:
                name = "contraction" if way > 0.0 else "extension"
                found[f"{name} to 10 um by the limit"].append(m["near"] / m["least"])
        for (a, f), rms in zip(SINES, b[law]["tracking"], strict=True):
            found[f"sine of {a} mm at {f} Hz, RMS"].append(rms)
        # The results for the variants are without, as those tables do not show it.
        for (_, f), rms in zip(SINES, b[law].get("learned", (np.nan,) * len(SINES)), strict=True):
            found[f"the same at {f} Hz, learned in 10 runs"].append(rms)
    return found


def draw(every: list[dict[str, Any]]) -> None:
    """The figure: time over distance of both laws and the limit, and the RMS of the holds."""
    figure, axes = new(4.2, 1, 2)
    mine = [b for b in every if b["kind"] == GROUPS[0] and "refused" not in b]
    for law, color in zip(LAWS, (BLUE, ORANGE), strict=True):
        moves = [m for b in mine for m in b[law]["moves"]]
        way = [m["to"] - m["from"] for m in moves]
        near = [m["near"] for m in moves]
        axes[0, 0].plot(way, near, ".", color=color, markersize=4, label=law)
        rms = np.sort([m["rms"] for m in moves])
        axes[0, 1].plot(rms, np.linspace(0.0, 1.0, len(rms)), color=color, label=law)
    moves = [m for b in mine for m in b["inverse"]["moves"]]
    way, least = [m["to"] - m["from"] for m in moves], [m["least"] for m in moves]
    axes[0, 0].plot(way, least, "_", color=GREEN, markersize=4, label="limit")
    axes[0, 1].set_xscale("log")
    finish(axes[0, 0], "Settling", "distance [mm]", "time to within 10 um [s]", legend=True)
    finish(axes[0, 1], "Holding", "RMS error [um]", "share of the moves", legend=True)
    (beyond.FIGURES / "beyond-micro.png").write_bytes(encode(figure))


def tables(every: list[dict[str, Any]]) -> dict[str, str]:
    """The tables of the page."""
    # The thesis' law has nothing identified: it is the same in both groups.
    shown = {
        "micro": [(GROUPS[0], LAWS[0]), *((group, LAWS[1]) for group in GROUPS)],
        "middle": [(GROUPS[1], MIDDLE)],
    }
    columns = {
        mark: {f"{law}, {g}": rows(beyond.of_group(every, g), law) for g, law in pairs}
        for mark, pairs in shown.items()
    }
    return {
        mark: measured_page.table(*beyond.compared(TABLE, each)) for mark, each in columns.items()
    }


def jobs(chosen: argparse.Namespace) -> list[Any]:
    """Every bench to measure."""
    return [
        (kind, k, settings, chosen.scratch)
        for k, settings in enumerate(beyond.drawn(table.of_stage("micro"), chosen, SEED))
        for kind in GROUPS
    ]


STUDY = measured_page.Study(
    beyond.PAGE, measured_page.RAW / "beyond-micro.json", jobs, one, tables, draw
)

if __name__ == "__main__":
    measured_page.main(__doc__, STUDY)
