"""Measures both stages together for validation/beyond.md: the thesis' programme, ten times, no fan.

    python docs/make_beyond_both.py --benches 20

Each bench differs in both stages as those of make_beyond.py and make_beyond_micro.py do, and is
identified from its sensors as they are. Only the judge reads the bench.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

import beyond
import make_beyond
import make_beyond_micro
import measured_page
import numpy as np
from beyond import GROUPS, Quantity

from macromicro import hall_table
from macromicro import programme as programmes
from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording
from macromicro.runs import programmed
from macromicro.runs.programmed import load, moves_of
from macromicro.schema.par import changed
from macromicro.settings import Settings
from macromicro.uncertainty import table

CYCLES = 10
SEED = 11  # of the published benches
LAWS = ("pd-tuned,pi-antiwindup", "terminal,inverse")
SEQUENCE = {
    "controller.sequence.overlap": 1,
    "controller.sequence.dwell": 0.05,
    "controller.sequence.wait": 0.1,
}
CLOSE = 2e-3  # mm, of the micro-stage and of the swing
# One cycle of the programme for the micro-stage alone, with its return to zero.
FINE = (1.5, 3.0, 1.5, 0.3, 0.0)
HOLD = 2.0  # s
LONGEST = HOLD / 1.5  # s: a limit that leaves a law room to be late within the hold
TABLE = (
    Quantity("macro, micro and swing close", "s", 2),
    Quantity("laser error in cycle 1", "um", 1),
    Quantity("laser error in cycle 10", "um", 1),
    Quantity("true error in cycle 10", "um", 1),
    Quantity("extension to 10 um in cycle 10 by the limit", "", 3),
    Quantity("extension in cycle 10 by the same in cycle 1", "", 3),
    Quantity("the same, of the limit", "", 3),
)


def spread(spans: dict[str, float]) -> list[table.Uncertain]:
    """What differs in both stages."""
    return [*make_beyond.spread(spans), *table.of_stage("micro")]


class Models(NamedTuple):
    """What the package's laws know, as `identify carriage` and `identify actuator` find it."""

    own: dict[str, float]
    fine: Inverse | None


def identified(settings: Settings, seed: int) -> Models:
    """From strokes, and from heating in the kiln and on the bench."""
    own = make_beyond.gains(make_beyond.identified(settings, seed))
    return Models(own, make_beyond_micro.identified(settings, seed).gains)


def under(settings: Settings, laws: str, models: Models) -> Settings:
    """The bench under a pair of laws; the package's run both stages at once."""
    if laws == LAWS[0]:
        return make_beyond.under(settings, laws, {})
    tree = make_beyond.under(settings, laws, models.own)
    if models.fine is not None:
        tree = tree._replace(controller=tree.controller._replace(fine=models.fine))
    made: Settings = changed(tree, SEQUENCE)
    return made


def arrived(run: Recording, single: Programme) -> list[float]:
    """After each macro command until both stages and the swing stay close, by the truth, s."""
    kinds = np.tile(single.stage, CYCLES)
    off = np.abs(run["macro_position"] - run["macro_reference"]) > 0.0
    off |= np.abs(run["true_belt"]) > 1e3 * CLOSE
    found = []
    for move in np.flatnonzero(kinds == MACRO):
        own = np.flatnonzero((run["move"] == move) | (run["move"] == move + 1))
        goal = run["micro_reference"][own[-1]]
        away = off[own] | (np.abs(run["true_micro"][own] - goal) > CLOSE)
        found.append(beyond.last(away) * run.dt)
    return found


def cycled(settings: Settings) -> dict[str, Any]:
    """Ten cycles: arrivals, and each hold's final error by the laser and by the truth."""
    single = load(programmes.find("thesis"), settings)
    done = programmed.record(single, settings, cycles=CYCLES)
    fault = done.outcome.fault
    if fault is not None:
        return {"stopped": f"{fault.message} {fault.evidence}"}
    run = done.recording
    fine = [m for m in moves_of(run, single.repeated(CYCLES), settings) if m.stage == "micro"]
    each = len(fine) // CYCLES
    last = fine[-each:]
    return {
        "arrived": arrived(run, single),
        "first": [m.final_error for m in fine[:each]],
        "laser": [m.final_error for m in last],
        "true": [m.true_error for m in last],
    }


def one(job: tuple[str, int, Settings, str]) -> dict[str, Any]:
    """One bench: identified or not, under both pairs of laws, each of which may be refused."""
    kind, k, settings, where = job
    folder = beyond.folder(where, "both", kind, k)
    found: dict[str, Any] = {"kind": kind, "bench": k}
    try:
        hall_table.of_bench(settings)
        models = identified(settings, 100 * k) if kind == GROUPS[0] else Models({}, None)
    except (InputError, RuntimeError) as error:
        return found | {"refused": str(error)}
    for laws in LAWS:
        own = under(settings, laws, models)
        found[laws] = cycled(own)
        try:
            found[laws]["fine"] = make_beyond_micro.moved(own, folder, FINE * 8 * CYCLES, HOLD)
        except (InputError, RuntimeError) as error:
            found[laws]["alone"] = str(error)
    beyond.said(kind, k, *(found[laws].get("alone", "") for laws in LAWS))
    return found


def _judged(move: dict[str, Any]) -> bool:
    """Whether a hold shows how late a move is: its limit ends well within, if there is one."""
    return move["least"] is not None and move["least"] <= LONGEST


def rows(every: list[dict[str, Any]], laws: str) -> dict[str, list[float]]:
    """By quantity, one value for each move of the benches that were not stopped."""
    found: dict[str, list[float]] = {each.name: [] for each in TABLE}
    for own in (b[laws] for b in every if "stopped" not in b[laws]):
        found["macro, micro and swing close"] += own["arrived"]
        found["laser error in cycle 1"] += map(abs, own["first"])
        found["laser error in cycle 10"] += map(abs, own["laser"])
        found["true error in cycle 10"] += map(abs, own["true"])
        fine = own.get("fine", [])  # none where the guard stopped the micro-stage alone
        size = len(fine) // CYCLES
        for first, last in zip(fine[:size], fine[len(fine) - size :], strict=True):
            extends = last["to"] < last["from"] and first["from"] == last["from"]
            if not extends or not _judged(first) or not _judged(last):
                continue
            ratios = (
                last["near"] / last["least"],
                last["near"] / first["near"],
                last["least"] / first["least"],
            )
            for quantity, ratio in zip(TABLE[4:], ratios, strict=True):
                found[quantity.name].append(ratio)
    return found


def tables(every: list[dict[str, Any]]) -> dict[str, str]:
    """The table of the page."""
    benches = {(g, law): beyond.of_group(every, g) for g in GROUPS for law in LAWS}
    columns = {
        f"{law.replace(',', ' and ')}, {g}": rows(mine, law) for (g, law), mine in benches.items()
    }
    head, lines = beyond.compared(TABLE, columns)
    stopped = [sum("stopped" in b[law] for b in mine) for (_, law), mine in benches.items()]
    lines.append(["benches stopped by the guard", *map(str, stopped)])
    return {"both": measured_page.table(head, lines)}


def jobs(chosen: argparse.Namespace) -> list[Any]:
    """Every bench to measure."""
    return [
        (kind, k, settings, chosen.scratch)
        for kind, spans in make_beyond.SPANS.items()
        for k, settings in enumerate(beyond.drawn(spread(spans), chosen, SEED))
    ]


STUDY = measured_page.Study(beyond.PAGE, measured_page.RAW / "beyond-both.json", jobs, one, tables)

if __name__ == "__main__":
    measured_page.main(__doc__, STUDY)
