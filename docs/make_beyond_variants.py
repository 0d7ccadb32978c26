"""Measures the variants of validation/beyond.md: laws on benches that no model describes.

    python docs/make_beyond_variants.py --workers 2

One bench for each end of each row of `uncertainty/variants.toml`, and one with all of them at once.
Each is identified from its sensors, as a bench that is not known, and makes the moves of
make_beyond.py or make_beyond_micro.py.
"""

from __future__ import annotations

import argparse
from typing import Any

import beyond
import make_beyond
import make_beyond_micro
import measured_page
import numpy as np
from beyond import GROUPS, Quantity

from macromicro import hall_table
from macromicro.settings import Settings
from macromicro.uncertainty import machines
from macromicro.uncertainty.table import VARIANTS, Uncertain

NONE, ALL = "none", "all"
MAKERS: dict[str, Any] = {"macro": make_beyond, "micro": make_beyond_micro}
# The middle way needs nothing identified, so it goes as shipped.
LAWS = {
    "macro": make_beyond.LAWS,
    "micro": (make_beyond_micro.LAWS[0], make_beyond_micro.MIDDLE, make_beyond_micro.LAWS[1]),
}
# Of each stage's table: quantity, its digits; judged by median and worst.
SHOWN = {
    "macro": (
        Quantity("200 mm to 1 count", "s", 3),
        Quantity("counts beyond the target", "", 0),
        Quantity("swing 0.1 s after, above 40 mm", "um", 1),
        Quantity("tracking, true position", "counts", 2),
    ),
    "micro": (
        Quantity("RMS in a hold", "um", 2),
        Quantity("contraction to 10 um by the limit", "", 2),
        Quantity("extension to 10 um by the limit", "", 2),
        Quantity("over the target", "um", 1),
        Quantity("sine of 0.5 mm at 0.5 Hz, RMS", "um", 1),
    ),
}


def benches(stage: str) -> list[tuple[str, Settings]]:
    """Name and settings of each bench of a stage."""
    rows = [row for row in VARIANTS if row.stage == stage]
    found = [(NONE, Settings())]
    for row in rows:
        found += [
            (f"{row.name} {end:+g}{row.unit and ' '}{row.unit}", _with([(row, end)]))
            for end in (row.low, row.high)
            if end != 0.0
        ]
    return [*found, (ALL, _with([(row, row.high) for row in rows]))]


def _with(ends: list[tuple[Uncertain, float]]) -> Settings:
    rows, amounts = zip(*ends, strict=True)
    return machines.settings_at(Settings(), rows, np.array(amounts))


def one(job: tuple[str, int, str, Settings, str]) -> dict[str, Any]:
    """One bench, identified and moved by the laws of the stage."""
    stage, k, name, settings, scratch = job
    maker = MAKERS[stage]
    found: dict[str, Any] = maker.one((GROUPS[0], k, settings, f"{scratch}/variants-{stage}"))
    if stage == "micro" and "refused" not in found:
        found[make_beyond_micro.MIDDLE] = middle(settings, scratch, k)
    beyond.said(stage, name, found.get("refused", ""))
    return {**found, "kind": stage, "name": name}


def middle(settings: Settings, scratch: str, k: int) -> dict[str, Any]:
    """A bench moved by the law between, as shipped."""
    folder = beyond.folder(scratch, "variants-middle", k)
    hall_table.of_bench(settings)
    tree = beyond.under(settings, make_beyond_micro.MIDDLE)
    moves = make_beyond_micro.moved(tree, folder)
    return {"moves": moves, "tracking": make_beyond_micro.tracked(tree, folder)}


def stage_table(every: list[dict[str, Any]], stage: str) -> str:
    """The table of a stage: a row for each bench."""
    quantities = SHOWN[stage]
    lines = []
    for bench in every:
        if bench["kind"] != stage:
            continue
        if "refused" in bench:
            lines.append([bench["name"], "", bench["refused"], *[""] * len(quantities[1:])])
            continue
        # The thesis' law is there to compare with: without a variant, and with all.
        for law in LAWS[stage][0 if bench["name"] in (NONE, ALL) else 1 :]:
            values = MAKERS[stage].rows([bench], law)
            cells = [each.cell(values[each.name], beyond.WORST) for each in quantities]
            lines.append([bench["name"], f"`{law}`", *cells])
    return measured_page.table(["variant", "law", *(each.title for each in quantities)], lines)


def tables(every: list[dict[str, Any]]) -> dict[str, str]:
    """A table for each stage that was measured."""
    stages = dict.fromkeys(bench["kind"] for bench in every)
    return {f"variants {stage}": stage_table(every, stage) for stage in stages}


def jobs(chosen: argparse.Namespace) -> list[Any]:
    """Every bench to measure."""
    return [
        (stage, k, name, settings, chosen.scratch)
        for stage in MAKERS
        for k, (name, settings) in enumerate(benches(stage))
    ]


STUDY = measured_page.Study(
    beyond.PAGE, measured_page.RAW / "beyond-variants.json", jobs, one, tables
)

if __name__ == "__main__":
    measured_page.main(__doc__, STUDY)
