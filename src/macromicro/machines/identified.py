"""Merges identified mass and friction into the machine file of the data sheets."""

from __future__ import annotations

import json
import math
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import place as places
from macromicro.errors import InputError, ProblemError
from macromicro.identify import axis_settings
from macromicro.identify.axis import Axis
from macromicro.identify.result import Result
from macromicro.machines import axis, rotary, sheets
from macromicro.machines import machine as machines
from macromicro.plant.power import CURRENT
from macromicro.schema import config
from macromicro.schema.text import printable


class Sheet(NamedTuple):
    """A machine file of data sheets."""

    file: str
    machine: machines.Machine
    table: dict[str, Any]  # what it says, as TOML has it
    tree: Any  # settings that follow


def sheet(path: Path) -> Sheet:
    """Read a machine file for `merged`."""
    file = printable(path, 300)
    machine, tree = machines.load(path)
    if machine.name not in (axis.NAME, rotary.NAME):
        accepted = f"{axis.NAME} or {rotary.NAME}"
        raise InputError(f"--machine {file}, {machines.KEY}", machine.name, accepted)
    table = config.table(path)
    return Sheet(file, machine, table, tree)


def merge(found: Result, known: Sheet) -> str:
    """The sheets' file with identified values and their sources, as TOML."""
    place = places.of(known.tree)
    model, where = found.model, f"--machine {known.file}"
    unit = next((line.unit for line in found.lines if line.name == "viscous"), "")
    per_volt = 1.0 / sheets.per_newton(known.tree)
    scales = {f"{place.named('N')}*s/{place.base}": 1.0, f"V*s/{place.base}": per_volt}
    if not isinstance(model, Axis) or unit not in scales:
        units = f"u in V or {place.named('N')} and x in {place.base}"
        problem = f"the result is in {unit or 'other parameters'}"
        raise ProblemError(where, problem, f"Identify friction without bristles, with {units}.")
    scale = scales[unit]
    values = dict(_values(model, found.uncertainty, scale, known, where))
    if place.turns:
        values = {
            path.replace("load.mass", "load.inertia"): row
            for path, row in values.items()
            if path != "load.incline"
        }
    settings = dict(_flat(known.table))
    settings.pop(machines.KEY, None)
    notes = dict.fromkeys(settings, f"as in {known.file}")
    for path, (value, unit, note) in values.items():
        before = f"; {known.file} had {settings[path]}" if path in settings else ""
        settings[path] = f'"{value!r} {place.named(unit) if place.turns else unit}"'
        notes[path] = f"{note}{before}"
    head = f"{known.file} with mass and friction as identified from {', '.join(found.files)}.\n"
    head += "What is not here follows from the data sheets, or is a default."
    text = axis_settings.as_toml(settings, head, known.machine.name, notes)
    table = tomllib.loads(text)
    table.pop(machines.KEY)
    config.overridden(known.machine.settings, table, f"{where} with what was identified")
    return text


def _values(
    model: Axis, errors: Mapping[str, float], scale: float, known: Sheet, where: str
) -> Iterator[tuple[str, tuple[float, str, str]]]:
    def source(name: str, less: str = "") -> str:
        error = f", +- {scale * errors[name]:.2g}" if name in errors else ""
        return f"identified{error}{less}"

    tree = known.tree
    rotor, payload = sheets.turning(tree), float(tree.load.payload)
    moved = scale * model.mass - rotor
    if not moved > payload:
        problem = f"the identified total is {scale * model.mass:.4g} kg"
        remedy = f"It must exceed motor, drive and payload, {rotor + payload:.4g} kg by the sheets."
        raise ProblemError(f"{where}, load.mass", problem, remedy)
    less = f", {rotor:.4g} of motor and drive taken off" if rotor else ""
    yield "load.mass", (moved - payload, "kg", source("mass", less))
    push = sheets.constant(tree) * tree.drive.efficiency
    back = 0.0
    if tree.amplifier.mode != CURRENT:
        back = push * sheets.constant(tree) / tree.motor.resistance
    viscous = max(scale * model.viscous - back, 0.0)
    less = f", {back:.4g} of back-EMF taken off" if back else ""
    yield "friction.viscous", (viscous, "N*s/m", source("viscous", less))
    yield "friction.coulomb", (scale * model.coulomb, "N", source("coulomb"))
    if model.stribeck > 0.0:
        yield "friction.stribeck", (scale * model.stribeck, "N", source("stribeck"))
        error = f", +- {errors['stribeck_speed']:.2g}" if "stribeck_speed" in errors else ""
        yield "friction.stribeck_speed", (model.stribeck_speed, "m/s", f"identified{error}")
    if abs(model.offset) > 2.0 * errors.get("offset", math.inf):
        incline = axis_settings.incline(scale * model.offset, moved)
        yield "load.incline", (incline, "rad", "identified: the weight of a constant force")


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{before}{name}.")
        else:
            yield f"{before}{name}", json.dumps(value, ensure_ascii=False)
