"""Readings of an instrument that no program reads: a list to go through, a CSV file, a keyboard."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from macromicro.calibration import targets
from macromicro.calibration.measuring import Readings
from macromicro.calibration.procedure import Request
from macromicro.calibration.targets import Visits
from macromicro.errors import InputError, ProblemError
from macromicro.machines import composite
from macromicro.machines.machine import Machine
from macromicro.place import Place
from macromicro.schema import csv_rows
from macromicro.schema.text import printable, read_text, write_text
from macromicro.units import quantity as parsed

WAYS = {"up": 1.0, "1": 1.0, "+1": 1.0, "down": -1.0, "-1": -1.0}
LEAST = 6  # readings
_ACCEPTED = (
    "columns position_mm, direction (up or down), and reference_mm or error_um; "
    "run and temperature_degC may follow"
)


def visits(request: Request) -> Visits:
    """The positions to go to, as a person would: few, and in two runs."""
    _alone(request)
    random = np.random.default_rng([request.seed, 1])
    places = targets.positions(request.settings, request.positions, random)
    return targets.along(request.settings, places, request.runs)


def _alone(request: Request) -> Place:
    if not isinstance(request.machine, Machine):
        raise ProblemError(
            "--config", "readings by hand are of one stage", "Give the file of a single stage."
        )
    return composite.places(request.machine)[0]


def write_list(path: Path, request: Request, *, overwrite: bool) -> None:
    """Write the positions with an empty column for the readings."""
    place = _alone(request)
    if path.exists() and not overwrite:
        raise ProblemError(
            printable(path, 300),
            "the file already exists",
            "Choose another one or add --overwrite.",
        )
    found = visits(request)
    lines = [
        "# Go to each position and fill in the last column. Rows of run 0 need no reading: they",
        "# only make the approach come from the right side.",
        f"run,direction,position_{place.unit},reference_{place.unit}",
    ]
    for run, way, target in zip(found.run, found.direction, found.target[:, 0], strict=True):
        lines.append(f"{int(run)},{'up' if way > 0 else 'down'},{place.per * target:.4f},")
    write_text(path, "\n".join(lines) + "\n")


def read(path: Path, request: Request) -> Readings:
    """Readings in a CSV file, of one stage or of two axes in a plane."""
    if isinstance(request.machine, Machine):
        return _of_one(path, request)
    return _of_plane(path, request)


def _units(names: list[str], known: Sequence[str], place: Place, where: str) -> dict[str, Column]:
    """The columns of some quantities, with their scales: ``position_mm``, ``x_error_um``."""
    units = {}
    for name in names:
        quantity, _, unit = name.rpartition("_")
        if quantity in known:
            scale = parsed(f"1 {unit}", place.base, f"{where}, {name}", place.unit)
            units[quantity] = Column(name, scale)
    return units


class Column(NamedTuple):
    name: str
    scale: float

    def of(self, row: csv_rows.Row) -> float:
        return self.scale * csv_rows.number(row.cells[self.name], f"{row.where}, {self.name}")


def _of_one(path: Path, request: Request) -> Readings:
    place, file = _alone(request), printable(path, 300)
    units: dict[str, Column] = {}

    def header(names: list[str], where: str) -> None:
        units.update(_units(names, ("position", "reference", "error"), place, where))
        if "position" not in units or "direction" not in names or len(units) < 2:
            raise InputError(where, printable(", ".join(names)), _ACCEPTED)

    rows: list[tuple[float, ...]] = []
    for row in csv_rows.table(read_text(path, "readings (.csv)"), file, header, _ACCEPTED):
        what = "reference" if "reference" in units else "error"
        if not row.cells[units[what].name]:
            continue
        way = WAYS.get(row.cells["direction"].lower())
        if way is None:
            found = printable(row.cells["direction"])
            raise InputError(f"{row.where}, direction", found, "up or down")
        target, value = units["position"].of(row), units[what].of(row)
        degrees = row.cells.get("temperature_degC", "")
        rows.append(
            (
                float(row.cells.get("run") or 1),
                way,
                target,
                value if what == "reference" else target + value,
                csv_rows.number(degrees, f"{row.where}, temperature_degC") if degrees else math.nan,
            )
        )
    return _readings(rows, file)


def _of_plane(path: Path, request: Request) -> Readings:
    """Errors of both axes over a grid, such as a camera's; they have no direction."""
    file, names = printable(path, 300), composite.names(request.machine)
    place = composite.places(request.machine)[0]
    wanted = (*names, *(f"{name}_error" for name in names))
    accepted = f"columns {', '.join(f'{each}_{place.unit}' for each in wanted)}"
    units: dict[str, Column] = {}

    def header(columns: list[str], where: str) -> None:
        units.update(_units(columns, wanted, place, where))
        if len(units) < len(wanted):
            raise InputError(where, printable(", ".join(columns)), accepted)

    table = csv_rows.table(read_text(path, "readings (.csv)"), file, header, accepted)
    rows = np.array([[units[each].of(row) for each in wanted] for row in table])
    if len(rows) < LEAST:
        raise ProblemError(file, f"{len(rows)} readings", f"Give {LEAST} or more over both axes.")
    both = np.concatenate([rows, rows])  # for either direction
    count = len(names)
    target, way = both[:, :count], np.repeat([1.0, -1.0], len(rows))
    flank = np.repeat(0.5 + 0.5 * way[:, None], count, axis=1)
    return Readings(
        np.ones(len(both)), way, np.zeros(len(both)), target, target, target, flank,
        target + both[:, count:], np.full(len(both), math.nan),
    )  # fmt: skip


def _readings(rows: list[tuple[float, ...]], where: str) -> Readings:
    if len(rows) < LEAST:
        remedy = f"Give {LEAST} or more, from below and from above."
        raise ProblemError(where, f"{len(rows)} readings", remedy)
    run, way, target, reference, degrees = np.array(rows).T
    column = target[:, None]
    return Readings(
        run, way, np.zeros(len(run)), column, column, column, 0.5 + 0.5 * way[:, None],
        reference[:, None], degrees,
    )  # fmt: skip


def asked(request: Request, answers: Iterable[str], shown: TextIO) -> Readings:
    """Readings typed at the keyboard, one after each position that the person has gone to."""
    place, found = _alone(request), visits(request)
    rows: list[tuple[float, ...]] = []
    lines = iter(answers)
    print(
        f"Go to each position from the side that is named, then type the reading in {place.unit}. "
        "An empty line leaves a position out, q ends.",
        file=shown,
    )
    for run, way, target in zip(found.run, found.direction, found.target[:, 0], strict=True):
        side = "below" if way > 0.0 else "above"
        where = f"{place.per * target:.4f} {place.unit} from {side}"
        if run == 0:
            print(f"go to {where}; no reading here", file=shown)
            continue
        value = _answer(lines, where, place, shown)
        if value is None:
            break
        if not math.isnan(value):
            rows.append((run, way, target, value / place.per, math.nan))
    return _readings(rows, "--by-hand")


def _answer(lines: Iterable[str], where: str, place: Place, shown: TextIO) -> float | None:
    """A number; NaN for a position that is left out, None at the end."""
    while True:
        print(f"{where}: ", end="", file=shown, flush=True)
        line = next(iter(lines), "q").strip()
        if line.lower() == "q":
            return None
        if not line:
            return math.nan
        try:
            return csv_rows.number(line, "--by-hand")
        except InputError:
            print(f"{printable(line)} is not a number in {place.unit}", file=shown)
