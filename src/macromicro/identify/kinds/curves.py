"""First-order curves from a recording of input and output."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.curves import Kind, direction
from macromicro.identify.picking import Picked
from macromicro.identify.smoothing import window_means

Pair = tuple[Array, Array]

_NEAR = 0.1  # a cycle begins within this part of the range from an end of it
_BACK = 0.5  # of its range: what ends nearer to its begin is a cycle
_LEG = 0.03  # what turns by less than this part of the range is noise; of the output, too
_WINDOWS = 300  # points of a curve over the whole range


class Found(NamedTuple):
    """`curves` of one `kind`, and the whole `records` (u, f) that they come from."""

    curves: list[Pair]  # pairs of input and output, shape (m,) each
    kind: Kind  # the kind of all of them
    records: list[Pair]  # the whole records that they were cut from, as pairs


def from_tables(tables: list[Picked], kind: str) -> Found:
    """Curves of the files: by the column `curve`, or cut out of the time record or its cycles."""
    pairs = _named(tables)
    if pairs and sum(map(_whole_cycle, pairs)) <= 0.5 * len(pairs):  # a record may end within one
        ways = [direction(u) for u, _ in pairs]
        many: Kind = "ascending" if sum(np.sign(ways)) > 0.0 else "descending"
        return Found(pairs, _requested(kind) or many, [])
    records = [cleaned(table) for table in tables]
    down = [c for u, f in records for c in cut(u, f)]
    up = [(-u, -f) for a, b in records for u, f in cut(-a, -b)]
    way = _requested(kind) or ("ascending" if len(up) > len(down) else "descending")
    curves = up if way == "ascending" else down
    if len(curves) < 2:
        raise ProblemError(
            tables[0].file,
            f"{len(curves)} {way} curves found: the input never reverses in cycles from one end",
            "Move the input from one end of its range to different turning points and back, "
            "twice or more.",
        )
    return Found(curves, way, records)


def _requested(kind: str) -> Kind | None:
    if kind not in ("auto", "ascending", "descending"):
        raise InputError("--curves", kind, "auto, ascending or descending")
    return "ascending" if kind == "ascending" else "descending" if kind == "descending" else None


def _named(tables: list[Picked]) -> list[Pair]:
    """Curves by the column `curve`; none where a file lacks it."""
    if not all("curve" in table.values for table in tables):
        return []
    found = []
    for table in tables:
        u, f, curve = (table.values[n] for n in ("u", "f", "curve"))
        found += [(u[curve == c], f[curve == c]) for c in dict.fromkeys(curve.tolist())]
    return found


def _whole_cycle(pair: Pair) -> bool:
    """Whether the input comes back to where it began."""
    u, _ = pair
    return bool(abs(u[-1] - u[0]) < _BACK * np.ptp(u))


def cleaned(table: Picked, least: int = 20) -> Pair:
    """Input and output over time, a thermocouple's without spikes and noise."""
    u, f = table.values["u"], table.values["f"]
    for name, values in (("u", u), ("f", f)):
        if np.ptp(values) == 0.0:
            raise ProblemError(
                f"{table.file}, {name}",
                f"the column is constant at {values[0]:g}",
                "Record a change.",
            )
    if len(u) < least:
        problem, remedy = f"the file has {len(u)} rows", f"Give {least} rows or more."
        raise ProblemError(table.file, problem, remedy)
    if table.names["u"] == "thermocouple" and "t" in table.values:
        from macromicro.identify.kiln import NOISE_S
        from macromicro.identify.runs import checked
        from macromicro.identify.smoothing import without_spikes

        run = checked(table.values["t"], u, f, table.file)
        u, f = without_spikes(run.t, run.u).values, run.x
        samples = int(NOISE_S / run.dt) | 1
        if 5 <= samples <= len(u):
            from scipy.signal import savgol_filter

            u = np.asarray(savgol_filter(u, samples, 2), dtype=np.float64)
    return u, f


def cut(u: Array, f: Array) -> list[Pair]:
    """Descending curves: falls of the input that follow a rise from its low end."""
    # A rise also begins where the output equals its value at the low end, since a record may begin
    # below it in a cold room. Points are means over windows, so that noise does not reorder them.
    from macromicro.identify.kiln import turning_points

    extent = float(np.ptp(u))
    low = float(u.min()) + _NEAR * extent
    off = np.abs(f - f[np.argmin(u)]) > _LEG * float(np.ptp(f))
    turns = turning_points(u, _LEG * extent)
    found = []
    for (before, top), (_, end) in pairwise(pairwise(turns)):
        fall = u[top : end + 1]
        if (u[before] > low and off[before]) or fall[0] - fall[-1] < _LEG * extent or len(fall) < 5:
            continue
        uu, ff = window_means(fall, f[top : end + 1], len(fall), extent / _WINDOWS)
        # The curve begins where the record turned, not in the middle of its first window.
        count = max(len(fall) // 1000, 1)
        found.append((np.r_[fall[0], uu[1:]], np.r_[f[top : top + count].mean(), ff[1:]]))
    return found
