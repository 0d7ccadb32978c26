"""Measures both stages together for validation/beyond.md: the thesis' programme, ten times, no fan.

    python docs/make_beyond_both.py --benches 20

Each bench differs in both stages as those of make_beyond.py and make_beyond_micro.py do, and is
identified from its sensors as they are. Only the judge reads the bench.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, NamedTuple

import make_beyond
import make_beyond_micro
import measured_page
import numpy as np

from macromicro import hall_table
from macromicro import programme as programmes
from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError
from macromicro.identify import carriage
from macromicro.programme import MACRO, Programme
from macromicro.recording import Recording
from macromicro.runs import programmed
from macromicro.runs.programmed import load, moves_of
from macromicro.schema.par import changed
from macromicro.settings import Settings
from macromicro.uncertainty import machines, table

HERE = Path(__file__).parent
RESULTS, PAGE = measured_page.RAW / "beyond-both.json", HERE / "validation" / "beyond.md"
CYCLES = 10
SEED = 11  # of the published benches
GROUPS = make_beyond.GROUPS
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


def drawn(n: int, seed: int, spans: dict[str, float]) -> list[Settings]:
    """Benches that differ in both stages."""
    rows = [*make_beyond.spread(spans), *table.of_stage("micro")]
    sample = machines.draw(Settings(), rows, n, seed)
    return [machines.settings_at(Settings(), rows, amounts) for amounts in sample.amounts]


class Models(NamedTuple):
    """What the package's laws know, as `identify carriage` and `identify actuator` find it."""

    own: dict[str, float]
    fine: Inverse | None


def identified(settings: Settings, seed: int) -> Models:
    """From strokes, and from heating in the kiln and on the bench."""
    found = make_beyond.identified(settings, seed).model
    own = {name: float(getattr(found, name)) for name in (*carriage.RIGID, *carriage.SWING)}
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
        found.append((int(np.flatnonzero(away)[-1]) + 1) * run.dt)
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
    folder = Path(where) / f"both-{kind.replace(' ', '-')}-{k}"
    folder.mkdir(parents=True, exist_ok=True)
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
    print(kind, k, *(found[laws].get("alone", "") for laws in LAWS), file=sys.stderr, flush=True)
    return found


TABLE = (
    ("macro, micro and swing close [s]", 2),
    ("laser error in cycle 1 [um]", 1),
    ("laser error in cycle 10 [um]", 1),
    ("true error in cycle 10 [um]", 1),
    ("extension to 10 um in cycle 10 by the limit", 3),
    ("extension in cycle 10 by the same in cycle 1", 3),
    ("the same, of the limit", 3),
)


def _judged(move: dict[str, Any]) -> bool:
    """Whether a hold shows how late a move is: its limit ends well within, if there is one."""
    return move["least"] is not None and move["least"] <= LONGEST


def rows(every: list[dict[str, Any]], laws: str) -> list[list[float]]:
    """For each row of `TABLE` one value for each move of the benches that were not stopped."""
    found: list[list[float]] = [[] for _ in TABLE]
    for own in (b[laws] for b in every if "stopped" not in b[laws]):
        found[0] += own["arrived"]
        for k, name in enumerate(("first", "laser", "true"), start=1):
            found[k] += [abs(e) for e in own[name]]
        fine = own.get("fine", [])  # none where the guard stopped the micro-stage alone
        size = len(fine) // CYCLES
        back = [
            (first, last)
            for first, last in zip(fine[:size], fine[len(fine) - size :], strict=True)
            if last["to"] < last["from"]
            and first["from"] == last["from"]
            and _judged(first)
            and _judged(last)
        ]
        found[4] += [last["near"] / last["least"] for _, last in back]
        found[5] += [last["near"] / first["near"] for first, last in back]
        found[6] += [last["least"] / first["least"] for first, last in back]
    return found


def told(every: list[dict[str, Any]]) -> str:
    """The table of the page."""
    ran = [b for b in every if "refused" not in b and b["bench"] > 0]
    names = [law.replace(",", " and ") for law in LAWS]
    head = " | ".join(f"{law}, {g}: median, 90 %, worst" for g in GROUPS for law in names)
    lines = [f"| | {head} |", "|---" * (1 + len(GROUPS) * len(LAWS)) + "|"]
    columns = [rows([b for b in ran if b["kind"] == g], law) for g in GROUPS for law in LAWS]
    for k, (name, digits) in enumerate(TABLE):
        cells = [
            ", ".join(
                f"{q:.{digits}f}" for q in (np.median(c[k]), np.quantile(c[k], 0.9), max(c[k]))
            )
            for c in columns
        ]
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    stopped = [
        sum("stopped" in b[law] for b in ran if b["kind"] == g) for g in GROUPS for law in LAWS
    ]
    lines.append("| benches stopped by the guard | " + " | ".join(map(str, stopped)) + " |")
    return "\n".join(lines) + "\n"


def tables(every: list[dict[str, Any]]) -> dict[str, str]:
    """By mark."""
    return {"both": told(every)}


def write(every: list[dict[str, Any]]) -> None:
    """The table into the page."""
    measured_page.put(PAGE, "both", tables(every)["both"])


def jobs(chosen: argparse.Namespace) -> list[Any]:
    """Every bench to measure."""
    return [
        (kind, k, settings, chosen.scratch)
        for kind in GROUPS
        for k, settings in enumerate(
            [
                Settings(),
                *drawn(chosen.benches, measured_page.seed(chosen, SEED), make_beyond.SPANS[kind]),
            ]
        )
    ]


if __name__ == "__main__":
    measured_page.main(__doc__, RESULTS, jobs, one, write, tables)
