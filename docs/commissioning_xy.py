"""Random machines of two axes on one clock for `make_commissioning`."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import commissioning
import commissioning_axis
import numpy as np

from macromicro.commission import axis, plane
from macromicro.commission.procedure import Options
from macromicro.errors import InputError
from macromicro.machines import compositions, results
from macromicro.machines.joint.settings import AXES


def drawn(random: np.random.Generator, number: int) -> Iterator[str]:
    """Settings files of machines that can work: each axis as those by themselves, on one period;
    half of them carry one on the other."""
    found = 0
    while found < number:
        x, y = commissioning_axis.figures(random), commissioning_axis.figures(random)
        y["timing.period"] = x["timing.period"]
        late = random.uniform(0.05, 1.0) * float(x["timing.period"].split()[0])
        for one in (x, y):
            one["timing.delay"] = f"{late!r} s"
        carries = "upper" if random.random() < 0.5 else "nothing"
        lines = ['machine = "xy"', f'stack.carries = "{carries}"']
        for name, one in zip(AXES, (x, y), strict=True):
            lines += [f"{name}.{path} = {json.dumps(value)}" for path, value in one.items()]
        text = "\n".join(lines) + "\n"
        with tempfile.TemporaryDirectory() as folder:
            try:
                compositions.each(_file(text, folder))
            except InputError:
                continue
        found += 1
        yield text


def _file(text: str, folder: str) -> Path:
    file = Path(folder) / "xy.toml"
    file.write_text(text, encoding="utf-8")
    return file


def tried(text: str, seed: int) -> commissioning.Tried:
    """One machine, commissioned; only what a person knows of it is said."""
    with tempfile.TemporaryDirectory() as folder:
        file = _file(text, folder)
        trees = [own for _, _, own in compositions.each(file)]
        pair, places = plane.virtual(file, seed)
    speed, travel = commissioning.SPEED, commissioning.TRAVEL
    first, second = (Options(p.effort, speed, speed / 25.0, travel) for p in places)
    found = plane.commission(pair, places, (first, second))
    errors: dict[str, tuple[float, bool]] = {}
    for name, tree, each in zip(AXES, trees, found.axes, strict=True):
        estimates = axis.KIND.estimates(each.model)
        about = commissioning.compared(estimates, commissioning_axis.truth(tree, each))
        errors |= {f"{name}.{path}": error for path, error in about.items()}
    unmet = ""
    if not found.met:
        there = results.count_arrived(found.moves)
        alone = [n for n, each in zip(AXES, found.axes, strict=True) if not each.verified.met]
        unmet = found.fault or f"{there} of {len(found.plan.legs)} moves of both arrived" + (
            f"; not verified alone: {', '.join(alone)}" if alone else ""
        )
    return {"errors": errors, "unmet": unmet}


DRAWN = commissioning.Machines("xy", 100, 2033, drawn, tried)
