"""Readings of an instrument that no program reads: a list to go through, a CSV file, a keyboard."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from macromicro.calibration import targets
from macromicro.calibration.measuring import Readings
from macromicro.calibration.procedure import Request
from macromicro.calibration.targets import Visits
from macromicro.errors import InputError, ProblemError
from macromicro.files import naming
from macromicro.machines import composite
from macromicro.machines.machine import Machine
from macromicro.place import Place
from macromicro.schema import csv_rows
from macromicro.schema.text import printable, read_text, write_text
from macromicro.units import alike
from macromicro.units import quantity as parsed

WAYS = {"up": 1.0, "+": 1.0, "1": 1.0, "+1": 1.0, "down": -1.0, "-": -1.0, "-1": -1.0}
LEAST = 6  # readings
_ACCEPTED = (
    "columns position_mm, direction (up or down), and reference_mm or error_um; "
    "run and temperature_degC may follow"
)
_PLAIN = ("run", "direction")  # columns without a unit


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


def read_readings(path: Path, request: Request) -> Readings:
    """Readings in a CSV file, of one stage or of two axes in a plane."""
    if isinstance(request.machine, Machine):
        return _of_one(path, request)
    return _of_plane(path, request)


class Column(NamedTuple):
    name: str  # as the heading has it
    scale: float

    def of(self, row: csv_rows.Row) -> float:
        return self.scale * csv_rows.number(row.cells[self.name], f"{row.where}, {self.name}")


def _columns(headings: list[str], units: Mapping[str, str], where: str) -> dict[str, Column]:
    """The columns by quantity: of `position_mm`, `Position [in]`, `x_error (um)`.

    `units` are those in which quantities are stored.
    """
    found = {}
    for heading in headings:
        quantity, unit = naming.split_unit(heading)
        if not unit:
            before, _, after = heading.rpartition("_")
            if unit := naming.spell_unit(after):  # "in", no unit in other files
                quantity = before
        quantity = quantity.lower().replace(" ", "_")
        if quantity in _PLAIN:
            found[quantity] = Column(heading, 1.0)
        elif quantity in units:
            named = f"{where}, {heading}"
            if not unit:
                accepted = f"a unit behind the name: {', '.join(alike(units[quantity]))}"
                raise InputError(named, "no unit", accepted)
            found[quantity] = Column(heading, parsed(f"1 {unit}", units[quantity], named))
    return found


def _of_one(path: Path, request: Request) -> Readings:
    place, file = _alone(request), printable(path, 300)
    units = dict.fromkeys(("position", "reference", "error"), place.base) | {"temperature": "degC"}
    columns: dict[str, Column] = {}

    def header(headings: list[str], where: str) -> None:
        columns.update(_columns(headings, units, where))
        errors = {"reference", "error"} & set(columns)
        if not errors or not {"position", "direction"} <= set(columns):
            raise InputError(where, printable(", ".join(headings)), _ACCEPTED)

    rows: list[tuple[float, ...]] = []
    for row in csv_rows.table(read_text(path, "readings (.csv)"), file, header, _ACCEPTED):
        cells = {quantity: row.cells[column.name] for quantity, column in columns.items()}
        what = "reference" if "reference" in columns else "error"
        if not cells[what]:
            continue
        way = WAYS.get(cells["direction"].lower())
        if way is None:
            where = f"{row.where}, {columns['direction'].name}"
            raise InputError(where, printable(cells["direction"]), "up or down")
        target, value = columns["position"].of(row), columns[what].of(row)
        rows.append(
            (
                columns["run"].of(row) if cells.get("run") else 1.0,
                way,
                target,
                value if what == "reference" else target + value,
                columns["temperature"].of(row) if cells.get("temperature") else math.nan,
            )
        )
    return _readings(rows, file)


def _of_plane(path: Path, request: Request) -> Readings:
    """Errors of both axes over a grid, such as a camera's; they have no direction."""
    file, names = printable(path, 300), composite.names(request.machine)
    place = composite.places(request.machine)[0]
    wanted = (*names, *(f"{name}_error" for name in names))
    accepted = f"columns {', '.join(f'{each}_{place.unit}' for each in wanted)}"
    columns: dict[str, Column] = {}

    def header(headings: list[str], where: str) -> None:
        columns.update(_columns(headings, dict.fromkeys(wanted, place.base), where))
        if not set(wanted) <= set(columns):
            raise InputError(where, printable(", ".join(headings)), accepted)

    table = csv_rows.table(read_text(path, "readings (.csv)"), file, header, accepted)
    rows = np.array([[columns[each].of(row) for each in wanted] for row in table])
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


def ask_readings(request: Request, answers: Iterable[str], shown: TextIO) -> Readings:
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
