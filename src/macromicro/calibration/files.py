"""The folder of a calibration: corrections, page, numbers, readings."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import macromicro
from macromicro.calibration import _pictures, iso
from macromicro.calibration.measuring import Readings
from macromicro.calibration.own_sensor import Own
from macromicro.calibration.procedure import Axis, Calibration
from macromicro.calibration.reversals import Turning
from macromicro.drawing import files as drawings
from macromicro.drawing.page import fill, save_figures
from macromicro.machines import composite, tree
from macromicro.machines.machine import as_toml
from macromicro.place import Place
from macromicro.runs import folder
from macromicro.schema import config
from macromicro.schema.text import plain, printable, write_text

PAGE, CORRECTIONS, SETTINGS = "calibration.html", "calibration.toml", "calibrated.toml"
NUMBERS, READINGS = "calibration.json", "readings.csv"
FILES = (PAGE, CORRECTIONS, SETTINGS, NUMBERS, READINGS, *drawings.names((_pictures.DEVIATIONS,)))
BYTES = 2_000_000
_TEMPLATE = Path(__file__).parent / "templates" / "calibration.html.j2"


class Row(NamedTuple):
    """A line of the table."""

    axis: str
    symbol: str
    meaning: str
    before: float | None
    after: float
    unit: str


def rows(found: Calibration) -> list[Row]:
    made = []
    for axis, place in _each(found):
        before, after = (iso.figures(m)._asdict() for m in (axis.before, axis.after))
        for name, meaning in iso.MEANINGS.items():
            symbol = iso.SYMBOLS.get(name, name)
            was, now = (_round_to_zero(place.fines * one[name]) for one in (before, after))
            made.append(Row(axis.name, symbol, meaning, was, now, place.fine))
        half = place.fines * axis.correction.half_width
        made.append(Row(axis.name, "±", "95 % of positions are within", None, half, place.fine))
    return made


def _each(found: Calibration) -> Iterable[tuple[Axis, Place]]:
    return zip(found.axes, composite.places(found.request.machine), strict=True)


def _turns(found: Calibration) -> Iterable[tuple[str, Place, Turning]]:
    machine = found.request.machine
    return zip(composite.names(machine), composite.places(machine), found.turns, strict=False)


class Line(NamedTuple):
    """An error that was found, with its 95 % interval."""

    axis: str
    name: str
    value: float
    half: float
    unit: str


def errors(found: Calibration) -> list[Line]:
    made = []
    for axis, place in _each(found):
        for each in axis.fit.estimates:
            scale, unit = _unit_scale(each.unit, place)
            made.append(Line(axis.name, each.name, scale * each.value, scale * each.half, unit))
    return made


def _round_to_zero(value: float) -> float:
    """Without the remains of an arithmetic that ends at 0."""
    return round(value, 4) + 0.0  # no -0


def _unit_scale(unit: str, place: Place) -> tuple[float, str]:
    if unit == "m":
        return place.fines, place.fine
    return {"1/K": (1e6, "um/m/K"), "1": (1e6, "um/m"), "rad": (1e3, "mrad")}[unit]


def text(found: Calibration) -> str:
    """What the terminal shows."""
    lines = [f"{'':<46}{'before':>9}{'after':>9}"]
    for row in rows(found):
        name = f"{row.axis} {row.symbol}".strip()
        before = "" if row.before is None else f"{row.before:.3g}"
        name += " " * (6 - len(name) + name.count("\u0304"))  # a macron takes no room
        lines.append(f"{name}{row.meaning:<40}{before:>9}{row.after:9.3g} {row.unit}")
    lines += [
        f"{f'{line.axis} {line.name}'.strip()}: {line.value:.4g} ± {line.half:.2g} {line.unit}"
        for line in errors(found)
    ]
    lines += _ripples(found, composite.places(found.request.machine)[0])
    lines += [
        f"{name} error after reversals, RMS: {place.fines * turn.before:.3g} before, "
        f"{place.fines * turn.after:.3g} {place.fine} after"
        for name, place, turn in _turns(found)
    ]
    if found.measured is found.before:
        lines += _tables(found)
    return "\n".join([*lines, *found.remarks])


def _tables(found: Calibration) -> Iterable[str]:
    """The fitted deviations; those of a wave or another axis come on top."""
    for axis, place in _each(found):
        p = axis.correction
        name = f"{axis.name} " if axis.name else ""
        yield f"{name}position [{place.unit}]   deviation from below, from above [{place.fine}]"
        places = np.linspace(p.low, p.high, len(p.up))
        for where, up, down in zip(places, p.up, p.down, strict=True):
            yield f"{place.per * where:12.4f}{place.fines * up:12.3f}{place.fines * down:12.3f}"


def write(out: Path, found: Calibration, kinds: Sequence[str] = drawings.DEFAULT) -> None:
    """Write everything, all of it or nothing; an earlier calibration there is replaced."""
    machine = found.request.machine
    with folder.staging(out, remove=FILES) as place:
        write_text(place / CORRECTIONS, corrections(found))
        write_text(place / SETTINGS, as_toml(machine, found.settings))
        write_text(place / NUMBERS, as_json(found))
        write_text(place / READINGS, readings(found))
        shown = save_figures(_pictures.draw(found), place, kinds)
        page = fill(
            _TEMPLATE,
            machine=machine.title,
            reference=found.reference,
            remarks=found.remarks,
            rows=rows(found),
            errors=errors(found),
            pictures=shown,
        )
        write_text(place / PAGE, page)


def corrections(found: Calibration | Own) -> str:
    """What a machine's file includes."""
    machine = found.request.machine
    heads = [
        f"# Calibration of {machine.title}, {date.today().isoformat()}, macromicro "
        f"{macromicro.__version__}; reference: {_reference(found)}.",
        f'# A settings file takes it by: include = "{CORRECTIONS}"',
        *(f"# {printable(remark, 300)}" for remark in found.remarks),
    ]
    parts = []
    for name, own in zip(composite.names(machine), machine.trees(found.settings), strict=True):
        start = f"{name}." if name else ""
        found_here = config.changed_toml(own.correction, type(own.correction)())
        parts.append(f"[{start}{tree.CORRECTION}]\n{found_here}")
        if hasattr(tree.gains(own), "rest"):
            rest = f"{start}{tree.gains_set(own)}.rest"
            parts.append(config.as_toml(found.settings, rest))
    return "\n".join(heads) + "\n\n" + "\n".join(parts)


def _reference(found: Calibration | Own) -> str:
    return "none" if isinstance(found, Own) else found.reference


def write_own(out: Path, found: Own) -> None:
    """Write what was measured without a reference."""
    with folder.staging(out, remove=FILES) as place:
        write_text(place / CORRECTIONS, corrections(found))
        write_text(place / SETTINGS, as_toml(found.request.machine, found.settings))
        write_text(place / NUMBERS, own_json(found) + "\n")


def own_text(found: Own) -> str:
    place = composite.places(found.request.machine)[0]
    lines = []
    if found.backlash is not None:
        value, half = (place.fines * each for each in found.backlash)
        lines.append(f"backlash and wind-up: {value:.4g} ± {half:.2g} {place.fine}")
    return "\n".join([*lines, *_ripples(found, place), *found.remarks])


def own_json(found: Own) -> str:
    place, gap = composite.places(found.request.machine)[0], found.backlash
    content = {
        "version": macromicro.__version__,
        "machine": found.request.machine.name,
        "unit": place.fine,
        "backlash": None if gap is None else place.fines * gap.value,
        "half_width_95": None if gap is None else place.fines * gap.half,
        "ripple": [each._asdict() for each in found.ripple],
        "remarks": found.remarks,
    }
    return json.dumps(plain(content, spelled=True), indent=2, allow_nan=False)


def _ripples(found: Calibration | Own, place: Place) -> list[str]:
    return [
        f"speed ripple of a slow pass: {each.before * place.per:.3g} before, "
        f"{each.after * place.per:.3g} {place.unit}/s after"
        for each in found.ripple
    ]


def as_json(found: Calibration) -> str:
    content = {
        "version": macromicro.__version__,
        "machine": found.request.machine.name,
        "reference": found.reference,
        "seed": found.request.seed,
        "table": [row._asdict() for row in rows(found)],
        "errors": [line._asdict() for line in errors(found)],
        "ripple": [each._asdict() for each in found.ripple],
        "reversals": {
            name: {"unit": place.fine} | {k: place.fines * v for k, v in turn._asdict().items()}
            for name, place, turn in _turns(found)
        },
        "remarks": found.remarks,
    }
    return json.dumps(plain(content, spelled=True), indent=2, allow_nan=False) + "\n"


def readings(found: Calibration) -> str:
    """All readings as CSV."""
    machine = found.request.machine
    named = zip(composite.names(machine), composite.places(machine), strict=True)
    heads = ["pass", "run", "direction", "t_s", "temperature_degC"]
    scales = []
    for name, place in named:
        start = f"{name}_" if name else ""
        heads += [f"{start}{what}_{place.unit}" for what in ("target", "reading", "reference")]
        scales.append(place.per)
    lines = [",".join(heads)]
    for title, part in zip(
        ("before", "fit", "after"), (found.before, found.measured, found.verified), strict=True
    ):
        lines += [f"{title},{line}" for line in _lines(part, scales)]
    return "\n".join(lines) + "\n"


def _lines(part: Readings, scales: Sequence[float]) -> Iterable[str]:
    for k in range(len(part.t)):
        values: list[Any] = [int(part.run[k]), int(part.direction[k]), round(float(part.t[k]), 4)]
        degrees = float(part.temperature[k])
        values.append("" if math.isnan(degrees) else round(degrees, 3))
        for j, scale in enumerate(scales):
            columns = (part.target, part.reading, part.reference)
            values += [np.format_float_positional(scale * c[k, j], 7, trim="-") for c in columns]
        yield ",".join(map(str, values))
