"""Exported units over many periods: the states of C and kernel stay one, bit for bit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.export import catalogue, files
from tests.export.bound import Bound, arrays, bits, built

PLANTS = ("axis.plant", "rotary.plant", "piezo.plant", "wire.plant", "two_stage.plant")
# Greatest effort, and how far an effort in float may be off, as a share of it.
FLOAT = {
    "two_stage.pid": 1e-5,
    "two_stage.pd_initial": 1e-5,
    "two_stage.pd_tuned": 1e-5,
    "axis.law": 1e-5,
    "piezo.law": 1e-5,
    "wire.law": 1e-5,
}


def course(name: str, folder: Path, periods: int) -> tuple[list[list[bytes]], list[list[bytes]]]:
    """A plant under random efforts: what C shows, and what the kernels show."""
    unit = catalogue.unit(name)
    written = files.write_unit(unit)
    library, bound = built(written, folder), Bound(written.program)
    by_name = {entry.name: (entry, made) for entry, made in zip(unit.entries, written.entries,
                                                                strict=True)}  # fmt: skip
    advance, made = by_name["advance"]
    show, shown = by_name["show"]
    params = unit.given["params"]
    twin = catalogue.unit(name).state  # with arrays of its own
    ours, theirs = unit.state, twin
    random = np.random.default_rng(3)
    top = 2.2 if name in ("wire.plant", "two_stage.plant") else 5.0
    found: tuple[list[list[bytes]], list[list[bytes]]] = ([], [])
    rest = list(advance.arguments[3:])
    held = 0.0
    for k in range(periods):
        if k % 20 == 0:
            held = float(random.uniform(-0.3, 1.0)) * top
        if name == "two_stage.plant":
            out = advance.arguments[2]._replace(motor=5.0 * held / top, ctrl=max(held, 0.0))
            given = [
                out,
                unit.entries[0].arguments[3]._replace(hall=held, laser=-held),
                unit.period,
            ]
        else:
            noises = advance.arguments[3].shape[1]
            given = [held, random.standard_normal((1, noises)), *rest[1:-1], unit.period]
        values = dict(zip(made.parameters, (params, theirs, *given), strict=True))
        memory = arrays(theirs)
        theirs = rebuilt(bound.call(library, made, values), ours, iter(memory))
        ours = advance.function(params, ours, *given)
        truth = bound.call(
            library, shown, dict(zip(shown.parameters, (params, theirs), strict=True))
        )
        found[0].append([*bits(theirs), *bits(truth), *[a.tobytes() for a in memory]])
        found[1].append(
            [*bits(ours), *bits(show.function(params, ours)), *[a.tobytes() for a in arrays(ours)]]
        )
    return found


def rebuilt(found: Any, like: Any, memory: Any) -> Any:
    """What C gave, as the kernel's types, with the arrays that C points at."""
    if isinstance(like, np.ndarray):
        return next(memory)
    if isinstance(like, tuple):
        parts = [rebuilt(f, v, memory) for f, v in zip(found, like, strict=True)]
        return type(like)(*parts) if hasattr(like, "_fields") else tuple(parts)
    return found


@pytest.mark.parametrize("name", PLANTS)
def test_a_plant_stays_the_same_for_many_periods(name: str, tmp_path: Path) -> None:
    theirs, ours = course(name, tmp_path, 60)
    assert theirs == ours
    assert len({tuple(each) for each in ours}) > 50


def test_hysteresis_forward_and_inverse_over_many_reversals(tmp_path: Path) -> None:
    unit, twin = catalogue.unit("preisach"), catalogue.unit("preisach")
    written = files.write_unit(unit)
    library, bound = built(written, tmp_path), Bound(written.program)
    table = unit.given["table"]
    advance, peek, invert, _ = unit.entries
    ours, theirs = unit.state, twin.state
    random, top = np.random.default_rng(5), table.lo + table.step * (table.n - 1)
    deepest = 0
    for k in range(300):
        target = float(random.uniform(0.0, 1.0))
        u = invert.function(table, ours, target)
        there = bound.call(library, written.entries[2],
                           {"table": table, "memory": theirs, "target": target})  # fmt: skip
        assert bits(there) == bits(u)
        if k % 3 == 0:
            u = float(random.uniform(table.lo - 5.0, top + 5.0))
        assert bits(bound.call(library, written.entries[1],
                    {"table": table, "memory": theirs, "u": u})) == bits(
                    peek.function(table, ours, u))  # fmt: skip
        after, f = bound.call(library, written.entries[0],
                              {"table": table, "memory": theirs, "u": u})  # fmt: skip
        theirs = rebuilt(after, ours, iter(arrays(theirs)))
        ours, expected = advance.function(table, ours, u)
        assert bits((theirs, f)) == bits((ours, expected))
        assert theirs.corners.tobytes() == ours.corners.tobytes()
        deepest = max(deepest, ours.pairs)
    assert deepest > 3


def off(name: str, folder: Path, periods: int = 400, config: Path | None = None) -> float:
    """How far a law in float is from it in double, as a share of its greatest effort."""
    unit = catalogue.unit(name, config)
    written = files.write_unit(unit, single=True)
    library, bound = built(written, folder), Bound(written.program)
    step, made = unit.entries[-1], written.entries[-1]
    names = list(made.parameters)
    gains = step.arguments[0]
    ours = step.arguments[1]
    # Arrays of float for C, which keeps those of its own precision.
    theirs, single = (converted(each) for each in (ours, gains))
    unit_size = 1.0 if "pid" in name or "pd" in name else 1e-3
    worst, most = 0.0, 0.0
    for k in range(periods):
        place = unit_size * math.sin(0.02 * k)
        if len(names) == 4:
            given: list[Any] = [20.0 * place, unit.period]
        else:
            target = step.arguments[2]._replace(position=place)
            sample = step.arguments[3]._replace(position=0.98 * place)
            given = [target, sample, unit.period]
        after, effort = bound.call(
            library, made, dict(zip(names, (single, theirs, *given), strict=True))
        )
        theirs = rebuilt(after, theirs, iter(arrays(theirs)))
        ours, expected = step.function(gains, ours, *given)
        worst, most = max(worst, abs(effort - expected)), max(most, abs(expected))
    return worst / most


def converted(value: Any) -> Any:
    """The same with arrays of floats of 32 bits."""
    if isinstance(value, np.ndarray):
        return value.astype(np.float32)
    if isinstance(value, tuple):
        parts = [converted(each) for each in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return value


@pytest.mark.parametrize("name", FLOAT)
def test_in_float_an_effort_is_nearly_the_same(name: str, tmp_path: Path) -> None:
    found = off(name, tmp_path)
    print(f"{name}: {found:.1e} of the greatest effort")
    assert 0.0 < found < FLOAT[name]


def test_the_exported_law_of_a_piezo_has_the_switch_of_its_inverse(tmp_path: Path) -> None:
    config = tmp_path / "plain.toml"
    config.write_text('machine = "piezo"\n[controller]\ninvert = 0\n', encoding="utf-8")
    assert catalogue.unit("piezo.law", config).given["gains"].invert == 0
    assert 0.0 < off("piezo.law", tmp_path, config=config) < FLOAT["piezo.law"]
