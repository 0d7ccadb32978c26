"""Commissions random machines and writes what came of it into validation/machines.md.

    python docs/make_commissioning.py [--kind KIND] [--benches N] [--rest]

Machines are drawn over wide ranges of data-sheet figures; what cannot work is drawn anew, by the
rules that a settings file meets, too. Each is commissioned as a person would do it, without a look
at its figures; then what was found is compared with them. KIND is axis, hanging, rotary, eccentric,
piezo, wire, xy, two_stage or examples; all of them without it, within some hours. What came of each
is kept: `--rest` does not do it again. `--quick` commissions one axis and writes nothing.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import commissioning
import commissioning_axis
import commissioning_piezo
import commissioning_rotary
import commissioning_two_stage
import commissioning_wire
import commissioning_xy
import measured_page
import numpy as np

from macromicro.commission import places
from macromicro.commission.procedure import Options
from macromicro.commission.running import commission
from macromicro.errors import MacromicroError
from macromicro.machines import results

EXAMPLES = "examples"
FOLDER = Path(__file__).resolve().parents[1] / "examples" / "machines"
DRAWN = {
    "hanging": commissioning_axis.HANGING,
    "rotary": commissioning_rotary.DRAWN,
    "eccentric": commissioning_rotary.ECCENTRIC,
    "piezo": commissioning_piezo.DRAWN,
    "wire": commissioning_wire.DRAWN,
    "xy": commissioning_xy.DRAWN,
    "two_stage": commissioning_two_stage.DRAWN,
    "axis": commissioning_axis.DRAWN,
}
SHOWN = {
    "axis": ("mass", "coulomb", "offset"),
    "rotary": ("mass", "coulomb", "offset"),
    "piezo": ("stroke", "hysteresis", "resonance"),
    "wire": ("way", "start", "tau"),
}


def jobs(chosen: argparse.Namespace) -> list[Any]:
    """Every example machine, then random ones of each kind, the axes last."""
    found: list[Any] = [
        (EXAMPLES, k, path) for k, path in enumerate(sorted(FOLDER.glob("[!x]*.toml")))
    ]
    for name, drawn in DRAWN.items():
        if chosen.kind in (None, name):
            random = np.random.Generator(np.random.PCG64(measured_page.seed(chosen, drawn.seed)))
            number = 1 if chosen.quick else measured_page.count(chosen, drawn.number)
            found += [(name, k, each) for k, each in enumerate(drawn.drawn(random, number))]
    return found


def one(job: tuple[str, int, Any]) -> dict[str, Any]:
    """One machine, commissioned, and compared with the truth."""
    kind, k, made = job
    found: dict[str, Any] = {"kind": kind, "bench": k}
    if kind == EXAMPLES:
        found["cells"] = example(made)
    else:
        found |= {"label": f"{DRAWN[kind].label} {k}", "errors": {}, "refused": "", "unmet": ""}
        try:
            found |= DRAWN[kind].tried(made, k)
        except MacromicroError as error:
            found["refused"] = str(error)
    print(found, flush=True)
    return found


def example(path: Path) -> list[str]:
    """An example machine commissioned, with no option but its file."""
    place = places.virtual(path)
    fast = commissioning.TURNING[0] if place.kind.place.turns else commissioning.SPEED
    far = commissioning.TURNING[1] if place.kind.place.turns else commissioning.SPEED
    options = Options(place.effort, fast, fast / 25.0, far, lowest=place.lowest)
    try:
        found = commission(place, options)
    except MacromicroError as error:
        return [f"`{path.name}`", f"refused: {error}", ""]
    estimates = place.kind.estimates(found.model)
    words = ", ".join(
        f"{name} {estimates[name].value:.4g} +- {estimates[name].half:.2g} {estimates[name].unit}"
        for name in SHOWN[place.kind.name]
    )
    there = results.count_arrived(found.verified.moves)
    return [f"`{path.name}`", words, found.verified.fault or f"{there}/{found.verified.asked}"]


def tables(every: list[dict[str, Any]]) -> dict[str, str]:
    """A table for each kind that was commissioned."""
    found = {}
    for kind in dict.fromkeys(each["kind"] for each in every):
        mine = [each for each in every if each["kind"] == kind]
        if kind == EXAMPLES:
            head = ["file", "found", "moves that arrived"]
            found[kind] = measured_page.table(head, [each["cells"] for each in mine])
        else:
            found[kind] = commissioning.summarise(mine)
    return found


STUDY = measured_page.Study(
    measured_page.VALIDATION / "machines.md",
    measured_page.RAW / "commissioning.json",
    jobs,
    one,
    tables,
)

if __name__ == "__main__":
    measured_page.main(__doc__, STUDY)
