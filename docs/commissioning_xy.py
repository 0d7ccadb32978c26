"""Random machines of two axes on one clock for `make_commissioning`."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import commissioning_axis
import numpy as np
from commissioning_table import SPEED, TRAVEL, Case, Tried, compared

from macromicro.commission import axis, plane
from macromicro.commission.procedure import Options
from macromicro.commission.stand import CommissionError
from macromicro.errors import InputError
from macromicro.machines import compositions, results
from macromicro.machines.joint.settings import AXES

NUMBER, SEED = 100, 2033


def written(random: np.random.Generator, file: Path) -> None:
    """A machine that can work, by the rules that a file meets: each axis as those by themselves,
    on one period; half of them carry one on the other."""
    while True:
        x, y = commissioning_axis.figures(random), commissioning_axis.figures(random)
        y["timing.period"] = x["timing.period"]
        late = random.uniform(0.05, 1.0) * float(x["timing.period"].split()[0])
        for one in (x, y):
            one["timing.delay"] = f"{late!r} s"
        carries = "upper" if random.random() < 0.5 else "nothing"
        lines = ['machine = "xy"', f'stack.carries = "{carries}"']
        for name, one in zip(AXES, (x, y), strict=True):
            lines += [f"{name}.{path} = {json.dumps(value)}" for path, value in one.items()]
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
        try:
            compositions.each(file)
        except InputError:
            continue
        return


def cases(number: int | None = None) -> Iterator[Case]:
    """So many, drawn one after the other."""
    random = np.random.Generator(np.random.PCG64(SEED))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "xy.toml"
        for k in range(NUMBER if number is None else number):
            written(random, file)
            yield Case(f"xy {k}", partial(one, f"xy {k}", file, k))


def one(label: str, file: Path, seed: int) -> Tried:
    """One machine, commissioned; only what a person knows of it is said."""
    trees = [own for _, _, own in compositions.each(file)]
    pair, places = plane.virtual(file, seed)
    first, second = (Options(p.effort, SPEED, SPEED / 25.0, TRAVEL) for p in places)
    try:
        found = plane.commission(pair, places, (first, second))
    except (CommissionError, InputError) as error:
        return Tried(label, {}, refused=str(error))
    errors: dict[str, tuple[float, bool]] = {}
    for name, tree, each in zip(AXES, trees, found.axes, strict=True):
        estimates = axis.KIND.estimates(each.model)
        about = compared(estimates, commissioning_axis.truth(tree, each))
        errors |= {f"{name}.{path}": error for path, error in about.items()}
    unmet = ""
    if not found.met:
        there = results.arrived(found.moves)
        alone = [n for n, each in zip(AXES, found.axes, strict=True) if not each.verified.met]
        unmet = found.fault or f"{there} of {len(found.plan.legs)} moves of both arrived" + (
            f"; not verified alone: {', '.join(alone)}" if alone else ""
        )
    return Tried(label, errors, unmet=unmet)
