"""CSV programmes: targets over time, each held until it changes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from macromicro.errors import InputError, ProblemError
from macromicro.programme.moves import (
    MACRO,
    MAX_MOVES,
    MICRO,
    STAGES,
    WHAT,
    Limits,
    Move,
    Programme,
    check_target,
    dense,
    programme,
)
from macromicro.schema import csv_rows
from macromicro.schema.text import printable, read_text

MAX_END = 24 * 3600.0
LEARNED = "micro_correction_um"
_TIME = -1
_LEARNED = -2
# Name: what the column is and how many of its unit make one s, m or count.
_TIMES = {"t_s": (_TIME, 1.0), "t_ms": (_TIME, 1e3)}
_COLUMNS = {
    **_TIMES,
    "macro_mm": (MACRO, 1e3),
    "macro_counts": (MACRO, 0.0),
    "micro_mm": (MICRO, 1e3),
    "micro_um": (MICRO, 1e6),
    LEARNED: (_LEARNED, 1e6),
}
_HEADER = "t_s or t_ms, and macro_mm or macro_counts, micro_mm or micro_um, or both"


class _Row(NamedTuple):
    line: int
    t: float
    targets: tuple[float, float]
    exact: tuple[float, float]
    correction: float = 0.0


def load_csv(path: Path, limits: Limits) -> Programme:
    """Read a scheduled programme.

    The stages start from 0, so a first row of 0 is no move, unless the last row leaves the stage
    elsewhere: a repeated programme has to return there. Every row counts in a trajectory of the
    macro-stage alone.
    """
    file = printable(path, 300)
    rows = list(_rows(read_text(path, WHAT), limits, file))
    if len(rows) < 2:
        found = f"the file has {'one row' if rows else 'no rows'}"
        raise ProblemError(file, found, "Give two or more; the last one's time is the end.")
    last, before = rows[-1], rows[-2]
    for name, stage in {"position": MACRO}.items() if limits.alone else STAGES.items():
        if _differ(before.targets[stage], last.targets[stage]):
            found = f"{name} changes in the last row"
            accepted = "Repeat the row before it: the last row only ends the programme."
            raise ProblemError(f"{file}, line {last.line}", found, accepted)
    exact = [row._replace(targets=row.exact) for row in rows]
    moves = _moves(exact)
    if not dense(
        [move.start for move in moves if move.stage == MACRO]
    ):  # the end of a move is a count
        moves = _moves(rows)
    elif math.isnan(last.targets[MICRO]):
        moves = _trajectory(exact)
    if not moves:
        raise ProblemError(file, "no moves", "At least one target has to change.")
    if len(moves) > MAX_MOVES:
        raise ProblemError(file, f"it has {len(moves)} moves", f"Give at most {MAX_MOVES}.")
    return programme(printable(path.stem, 200), moves, last.t, path)


def with_corrections(path: Path, programme: Programme) -> str:
    """A file's own text with a column of learned corrections."""
    names: list[str] = []
    text = read_text(path, WHAT)
    rows = list(csv_rows.table(text, str(path), lambda cells, _: names.extend(cells), _HEADER))
    names = [name for name in names if name != LEARNED]
    fine = programme.stage == MICRO
    start, learned = programme.start[fine], programme.correction[fine]
    written = [",".join((*names, LEARNED))]
    for row in rows:
        t = next(
            csv_rows.number(row.cells[n], row.where) / unit
            for n, (kind, unit) in _COLUMNS.items()
            if kind == _TIME and n in row.cells
        )
        k = int(np.searchsorted(start, t + 1e-9, side="right")) - 1
        value = learned[k] if k >= 0 else 0.0
        written.append(",".join((*(row.cells[n] for n in names), f"{1e6 * value:.4f}")))
    return "\n".join(written) + "\n"


def _differ(a: float, b: float) -> bool:
    return a != b and not math.isnan(b)


def _moves(rows: list[_Row]) -> list[Move]:
    """The changes, macro before micro at the same time, each held until the next change."""
    end = rows[-1].t
    returns = tuple(0.0 if last == 0.0 else math.inf for last in rows[-1].targets)
    previous, learned = returns, 0.0
    changes = []
    for row in rows[:-1]:
        stages = [s for s in (MACRO, MICRO) if _differ(previous[s], row.targets[s])]
        if MICRO not in stages and row.correction != learned:
            stages.append(MICRO)
        # A macro move disables the micro-stage: a fine position that holds on is taken again.
        if stages == [MACRO] and row.targets[MICRO] > 0.0:
            stages.append(MICRO)
        if stages:
            changes.append((row, stages))
        previous, learned = row.targets, row.correction
    nexts = [*(row.t for row, _ in changes), end][1:]
    return [
        Move(row.t, stage, row.targets[stage], after - row.t, row.correction * (stage == MICRO))
        for (row, stages), after in zip(changes, nexts, strict=True)
        for stage in stages
    ]


def _trajectory(rows: list[_Row]) -> list[Move]:
    """Rows of a macro trajectory, from the end of the first rest to the start of the last."""
    place = np.array([row.targets[MACRO] for row in rows])
    first = int(np.flatnonzero(place != place[0])[0]) - 1
    last = int(np.flatnonzero(place != place[-1])[-1]) + 1
    t = [row.t for row in (*rows[first : last + 1], rows[-1])]
    return [Move(t[k], MACRO, float(place[first + k]), t[k + 1] - t[k]) for k in range(len(t) - 1)]


def _rows(text: str, limits: Limits, file: str) -> Iterator[_Row]:
    t = -math.inf
    columns, words = _accepted_columns(limits)

    def header(cells: list[str], where: str) -> None:
        _header(cells, columns, words, where)

    for line in csv_rows.table(text, file, header, words):
        row = _row(line, columns, limits)
        csv_rows.increasing(row.t, t, line.where)
        t = row.t
        yield row


def _accepted_columns(limits: Limits) -> tuple[dict[str, tuple[int, float]], str]:
    """The accepted columns, and the same in words."""
    if not limits.alone:
        return _COLUMNS, _HEADER
    place = limits.place
    units = {place.unit: place.per, place.fine: place.fines, "counts": 0.0}
    own = {f"position_{unit}": (MACRO, per) for unit, per in units.items()}
    *some, last = own
    older = {f"macro_{unit}": (MACRO, per) for unit, per in units.items()}
    return {**_TIMES, **own, **older}, f"t_s or t_ms, and {', '.join(some)} or {last}"


def _header(
    cells: list[str], columns: dict[str, tuple[int, float]], words: str, where: str
) -> None:
    """Check that the columns are a time and one or both stages, each once."""
    for cell in cells:
        if cell not in columns:
            raise ProblemError(
                f"{where}, column {printable(cell)!r}", "unknown column", f"Accepted: {words}."
            )
    kinds = [columns[cell][0] for cell in cells]
    for cell, kind in zip(cells, kinds, strict=True):
        if kinds.count(kind) > 1:
            same = [name for name in cells if columns[name][0] == kind]
            found = f"{' and '.join(same)} are one quantity"
            raise ProblemError(f"{where}, column {cell}", found, f"Give one. Accepted: {words}.")
    if _TIME not in kinds or not {MACRO, MICRO} & set(kinds):
        raise ProblemError(where, f"the columns are {', '.join(cells)}", f"Accepted: {words}.")
    if _LEARNED in kinds and MICRO not in kinds:
        accepted = "It is added to micro_mm or micro_um, one of which has to be there."
        raise ProblemError(where, f"column {LEARNED} stands alone", accepted)


def _row(line: csv_rows.Row, columns: dict[str, tuple[int, float]], limits: Limits) -> _Row:
    where, t, targets = line.where, 0.0, [math.nan, math.nan]
    exact, correction = [math.nan, math.nan], 0.0
    for name, text in line.cells.items():
        place = f"{where}, {name}"
        kind, per_unit = columns[name]
        number = csv_rows.number(text, place)
        if kind == _TIME:
            t = number / per_unit
            if not 0.0 <= t <= MAX_END:
                raise InputError(place, text, "a time from 0 to 24 h")
            continue
        # Divided, not multiplied by 1e-3: so "1.5" mm is exactly the float 0.0015.
        value = number / per_unit if per_unit else number
        if kind == _LEARNED:
            correction = value
            continue
        if kind == MACRO and per_unit:
            value *= limits.counts_per_metre
        shown = f"{text} {name.partition('_')[2]}"
        targets[kind] = exact[kind] = check_target(value, kind, limits, place, shown)
        if kind == MACRO:
            exact[kind] = min(max(value, limits.macro_lo), limits.macro_hi)
    if correction:
        place = f"{where}, {LEARNED}"
        shown = f"{targets[MICRO] + correction} m with the target"
        check_target(targets[MICRO] + correction, MICRO, limits, place, shown)
    return _Row(line.line, t, (targets[0], targets[1]), (exact[0], exact[1]), correction)
