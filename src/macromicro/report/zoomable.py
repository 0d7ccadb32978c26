"""Recordings on one zoomable page: columns over time, drawn by uPlot, no network."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from macromicro import drawing, exported, traces
from macromicro.arrays import Array
from macromicro.drawing.page import fill
from macromicro.recording import Recording
from macromicro.recording_format import TIME
from macromicro.schema.par import NO_UNIT

TEMPLATE = Path(__file__).parent / "templates" / "zoomable.html.j2"
SCRIPT = TEMPLATE.with_name("zoomable.js")
UPLOT = Path(drawing.__file__).parent / "uplot"
MOST = 3_000_000  # values of a page; of more, each point stands for several rows
BYTES = 20_000_000  # that a page may have: MOST values of 4 bytes, as base64, and its words
_REFERENCE = "_reference"


def page(
    recordings: Sequence[Recording],
    columns: Sequence[str] = (),
    labels: Sequence[str] = (),
    most: int = MOST,
) -> str:
    """Write recordings as one HTML file that opens without a network.

    Columns of one unit share a panel, and all panels share the time. Values are in single precision
    from the middle of the column's range; long recordings are reduced to least and greatest values.
    """
    names = list(columns) or traces.default_columns(recordings)
    words = list(labels) or traces.distinct_labels(recordings)
    panels = traces.panels(recordings, names)
    told = [name for _, inside in panels for name in inside]
    values = len(told) * sum(map(len, recordings))
    every = 1 if values <= most else -(-2 * values // most)
    apart = traces.begin_apart(recordings)
    sides = [
        {"label": word, **_side(recording, told, every, own=apart)}
        for word, recording in zip(words, recordings, strict=True)
    ]
    data = {
        "panels": [{"unit": "" if u in NO_UNIT else u, "columns": inside} for u, inside in panels],
        "sides": sides,
        "references": [name for name in told if name.endswith(_REFERENCE)],
    }
    return fill(
        TEMPLATE,
        title=", ".join(words),
        data=data,
        library=[(UPLOT / name).read_text(encoding="utf-8") for name in ("uPlot.css", "uPlot.js")],
        script=SCRIPT.read_text(encoding="utf-8"),
        every=every,
        apart=apart,
        about=[(w, _about(r)) for w, r in zip(words, recordings, strict=True)],
        meanings=[(c.name, c.unit, c.meaning) for c in recordings[0].columns if c.name in told],
    )


def _side(recording: Recording, names: Sequence[str], every: int, *, own: bool) -> dict[str, Any]:
    t = np.asarray(recording[TIME], float)
    shown = t - t[0] if own and len(t) else t
    return {
        "every": every,
        "t": _pack(shown[::every], "<f8"),
        "columns": {name: _column(np.asarray(recording[name], float), every) for name in names},
    }


def _column(y: Array, every: int) -> dict[str, Any]:
    """A column, or the least and greatest value of each `every` rows."""
    known = y[np.isfinite(y)]
    middle = float((known.min() + known.max()) / 2.0) if len(known) else 0.0
    y = np.where(np.isfinite(y), y - middle, np.nan)
    if every == 1 or not len(y):
        return {"middle": middle, "low": _pack(y)}
    edges = np.arange(0, len(y), every)
    low, high = np.fmin.reduceat(y, edges), np.fmax.reduceat(y, edges)
    return {"middle": middle, "low": _pack(low), "high": _pack(high)}


def _pack(values: Array, kind: str = "<f4") -> str:
    """Deflated bytes as text, which browsers can inflate."""
    return base64.b64encode(zlib.compress(np.ascontiguousarray(values, kind).tobytes())).decode()


def _about(recording: Recording) -> str:
    rows, rate = len(recording), 1.0 / recording.dt
    head = f"{rows} row{'s' * (rows != 1)}, {rows * recording.dt:.6g} s at {rate:.6g} Hz"
    return ", ".join(part for part in (head, exported.origin(recording)) if part)
