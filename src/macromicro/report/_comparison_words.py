"""A comparison in words: tables of moves and columns, and the differences in a few sentences."""

from __future__ import annotations

import math

from macromicro.report.comparison import QUANTITIES, Comparison, Move
from macromicro.report.run import amount
from macromicro.schema.par import NO_UNIT

COLUMNS = ("column", "unit", "RMS difference", "largest", "at")
HEADINGS = ("#", "stage", "target", "settling", "by", "error at rest", "by", "overshoot", "by")


def table(found: Comparison) -> list[tuple[str, ...]]:
    several = len(found.sides) > 2
    return [
        ((found.sides[side].name,) if several else ()) + _cells(move, side)
        for move in found.moves
        for side in range(1, len(found.sides))
    ]


def columns(found: Comparison) -> list[tuple[str, ...]]:
    several = len(found.sides) > 2
    lines = []
    for side, parting in zip(found.sides[1:], found.partings, strict=True):
        for name in parting.differing:
            unit = found.sides[0].recording.unit(name)
            sizes = [
                "no number" if math.isnan(v) else f"{v:.4g}"
                for v in (parting.rms[name], parting.largest[name])
            ]
            at = "-" if math.isnan(parting.at[name]) else f"{parting.at[name]:.3f} s"
            head = (side.name,) if several else ()
            lines.append((*head, name, "-" if unit in NO_UNIT else unit, *sizes, at))
    return lines


def _cells(move: Move, side: int) -> tuple[str, ...]:
    old, new = move.results[0], move.results[side]
    cells = [str(move.move + 1), move.stage, f"{move.target:.6g} {move.unit}"]
    for quantity in QUANTITIES:
        unit = "s" if quantity == "settling_s" else move.unit
        digits = 1 if unit == "um" else 3
        mine = None if old is None else getattr(old, quantity)
        its = None if new is None else getattr(new, quantity)
        if quantity == "settling_s" and mine is None:
            cells.append("never")
        else:
            cells.append(amount(mine, digits, unit))
        cells.append(_by(move.difference(quantity, side), digits))
        if new is None:
            cells[-1] = "other move" if quantity == "settling_s" else ""
        elif quantity == "settling_s" and its is None and mine is not None:
            cells[-1] = "never"
        elif quantity == "settling_s" and its is not None and mine is None:
            cells[-1] = f"now {amount(its, digits, unit)}"
    return tuple(cells)


def _by(difference: float | None, digits: int) -> str:
    return "-" if difference is None else f"{round(difference, digits) + 0.0:+.{digits}f}"


def remarks(found: Comparison) -> list[tuple[str, str]]:
    lines = []
    for side in range(1, len(found.sides)):
        name = found.sides[side].name
        lines.append((name, _parting(found, side)))
        lines += [(name, text) for text in _structure(found, side)]
        if found.partings[side - 1].t is not None:
            lines += [(name, text) for text in _moves(found, side)]
    return lines


def _parting(found: Comparison, side: int) -> str:
    first, other = found.sides[0], found.sides[side]
    parting = found.partings[side - 1]
    lengths = [len(s.recording) * s.recording.dt for s in (first, other)]
    longer = lengths[1] - lengths[0]
    tail = f"; it is {abs(longer):.3f} s {'longer' if longer > 0 else 'shorter'}" if longer else ""
    if parting.t is None:
        count = len(found.columns)
        columns = "the shared column" if count == 1 else f"all {count} shared columns"
        exactly = "bit for bit" if first.recording.dt == other.recording.dt else "where both are"
        return f"equal to {first.name} in {columns}, {exactly}{tail}"
    shown = ", ".join(parting.columns[:4])
    more = len(parting.columns) - 4
    shown += f" and {more} more" if more > 0 else ""
    return f"differs from {first.name} from {parting.t:.3f} s on, first in {shown}{tail}"


def _structure(found: Comparison, side: int) -> list[str]:
    """Columns that only one has, other units, another period."""
    first, other, parting = found.sides[0], found.sides[side], found.partings[side - 1]
    texts = []
    if parting.lacking:
        texts.append(f"lacks columns of {first.name}: {', '.join(parting.lacking)}")
    if parting.added:
        texts.append(f"has columns that {first.name} lacks: {', '.join(parting.added)}")
    units = [f"{name} [{b}], there [{a}]" for name, (a, b) in parting.units.items()]
    if units:
        texts.append(f"other units, so not compared: {', '.join(units)}")
    if not math.isclose(first.recording.dt, other.recording.dt, rel_tol=1e-9):
        its, every = other.recording.dt, parting.period
        texts.append(
            f"a period of {its:g} s, not {first.recording.dt:g} s: compared every {every:g} s"
        )
    return texts


def _moves(found: Comparison, side: int) -> list[str]:
    alien = sum(m.results[side] is None for m in found.moves)
    if alien:
        return [f"{alien} of {len(found.moves)} moves differ or are missing here"]
    return [] if found.moves else ["no moves to compare"]
