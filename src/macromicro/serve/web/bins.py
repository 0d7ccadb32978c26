"""Telemetry for plots: the smallest and largest value in each pixel's time.

A frame is little-endian: `HEADER`, then float32[bins, channels, 2]; its first bins replace
those that were still incomplete.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.arrays import Array
from macromicro.control.live.parameters import Live
from macromicro.nominal import PERIOD
from macromicro.place import LENGTH, Place
from macromicro.serve.shared import RING_S

if TYPE_CHECKING:
    from macromicro.serve.settings import AnySettings

CHANNELS = (
    "macro reference",  # mm, homed frame; of a machine that turns, this and all places deg
    "macro position",  # mm
    "micro reference",  # mm
    "micro position",  # mm
    "motor",  # V
    "CTRL",  # V
    "temperature",  # degC, estimated
    "position",  # mm, whole
)
OF_STAGE = ("reference", "position", "motor")  # mm and V, behind the name of a further stage
SPANS = (2.0, 10.0, 60.0)  # s
LEAST, MOST = 16, 1200  # columns
KIND = 1
# kind, number of the view, bins, channels; first bin, width [s], time [s] and number of the
# newest row, its position, macro and micro position [mm] and uncertainty [um]; or deg and mdeg.
HEADER = struct.Struct("<4I8d")
# A file, or a piece of one, comes behind: kind, id of its order, size of the piece, 0; size of the
# file.
PIECE_KIND = 2
PIECE = struct.Struct("<4Id")


class View(NamedTuple):
    """A viewer's plot: `width` rows a bin, `columns` bins, `period` seconds a row."""

    number: int
    width: int
    columns: int
    period: float = PERIOD

    @property
    def rows(self) -> int:
        return self.width * self.columns


def view(number: int, span: float, columns: int, period: float = PERIOD) -> View:
    """A view of at least `span` seconds in about `columns` columns."""
    rows = max(round(min(span, RING_S) / period), 1)
    width = max(-(-rows // columns), 1)
    return View(number, width, -(-rows // width), period)


def bin_rows(values: Array, first: int, width: int) -> NDArray[np.float32]:
    """Min and max, float32[bins, channels, 2], of rows; row n belongs to bin n // width."""
    rows = values.shape[1]
    if rows == 0:
        return np.empty((0, values.shape[0], 2), np.float32)
    start = first // width
    edges = np.arange(start + 1, (first + rows - 1) // width + 1) * width - first
    cuts = np.concatenate([[0], edges])
    low = np.fmin.reduceat(values, cuts, axis=1)
    high = np.fmax.reduceat(values, cuts, axis=1)
    return np.ascontiguousarray(np.stack([low, high], axis=-1).transpose(1, 0, 2), np.float32)


class Plots(NamedTuple):
    """What is plotted of a machine: the channels made of its telemetry `names`."""

    names: Sequence[str]
    pitch: float
    place: Place = LENGTH
    axes: Sequence[tuple[str, Live]] = ()
    law: Sequence[str] = ()  # columns of the law's memory

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the `traces`."""
        further = (f"{name} {what}" for name, _ in self.axes[1:] for what in OF_STAGE)
        return (*CHANNELS, *further, *self.law)

    def traces(self, block: Array) -> Array:
        """The channels of some rows, float64[channels, rows], in the homed frame."""
        column, per = dict(zip(self.names, block, strict=True)), self.place.per
        share = 1e-3 * per  # of what people read, in a thousandth of what is counted in
        position, fine = column["position"] * share, column["hall_position"] * share
        macro = position - fine
        ahead = (column["macro_reference"] - column["macro_position"]) * self.pitch * per
        further: list[Array] = []
        for name, live in self.axes[1:]:
            off = (column[f"{name}_reference"] - column[f"{name}_count"]) * live.pitch * per
            here = column[f"{name}_position"] * share
            further += [here + off, here, column[f"{name}_motor"]]
        return np.stack(
            [
                macro + ahead,
                macro,
                column["micro_reference"] * share,
                fine,
                column["motor"],
                column["ctrl"],
                column["temperature_estimate"],
                position,
                *further,
                *(column[name] for name in self.law),
            ]
        )

    def frame(self, view: View, last: int, block: Array) -> bytes:
        """A frame of the rows `block` up to row number `last`; b"" if there are none."""
        rows = block.shape[1]
        if rows == 0:
            return b""
        values = self.traces(block)
        first = last - rows + 1
        bins = bin_rows(values, first, view.width)
        time = float(block[self.names.index("t"), -1])
        spread = float(block[self.names.index("uncertainty"), -1]) * 1e-3 * self.place.per
        newest = [float(values[k, -1]) for k in (7, 1, 3)]
        head = HEADER.pack(
            KIND,
            view.number,
            bins.shape[0],
            bins.shape[1],
            first // view.width,
            view.width * view.period,
            time,
            last,
            *newest,
            spread,
        )
        return head + bins.tobytes()


def plots(settings: AnySettings) -> Plots:
    """What is plotted of the machine with these settings."""
    live, law = settings.live, [column.name for column in settings.law_columns]
    return Plots(settings.telemetry.names, live.pitch, live.place, settings.axes, law)
