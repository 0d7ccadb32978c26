"""Comparison of recordings: their common columns, differences and moves, and its files."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import macromicro
from macromicro import traces
from macromicro.design.response import MoveResult
from macromicro.drawing import files
from macromicro.errors import InputError, ProblemError
from macromicro.files.recordings import recording
from macromicro.recording import Recording
from macromicro.recording_format import TIME
from macromicro.report import zoomable
from macromicro.report._partings import Parting, parting
from macromicro.report.run import as_json
from macromicro.runs import folder, judging
from macromicro.schema.text import printable, write_text

JSON = "compare.json"
OVERLAY = "overlay"
PAGE = f"{OVERLAY}.html"
BYTES = 20_000_000 + zoomable.BYTES
FILES = (JSON, PAGE, *files.names((OVERLAY,)))
QUANTITIES = ("settling_s", "final_error", "overshoot")
_ACCEPTED = "a recording (.h5) or the folder of a run"


class Side(NamedTuple):
    name: str  # as it is called in tables and figures
    path: Path  # its file
    recording: Recording  # what is in it
    moves: list[MoveResult]  # as `macromicro.moves` gives them; none where it has no moves


class Move(NamedTuple):
    """A move of the first recording, and the same move of the others."""

    move: int  # its place in the programme, from 0
    # stage, unit: as of a `MoveResult`
    stage: str
    unit: str
    target: float  # in `unit`
    # one for each recording; None for one in which this is another move, or none
    results: tuple[MoveResult | None, ...]

    def difference(self, quantity: str, side: int) -> float | None:
        old, new = (None if r is None else getattr(r, quantity) for r in self._pair(side))
        return None if old is None or new is None else float(new - old)

    def _pair(self, side: int) -> tuple[MoveResult | None, MoveResult | None]:
        return self.results[0], self.results[side]


class Comparison(NamedTuple):
    sides: tuple[Side, ...]  # the recordings; all are compared with the first
    columns: tuple[str, ...]  # what all have, in the same unit, `t` aside
    moves: tuple[Move, ...]  # those of the first
    partings: tuple[Parting, ...]  # one for each recording but the first


def load(places: Sequence[Path]) -> tuple[Side, ...]:
    if len(places) < 2:
        found = printable(places[0], 300) if places else "nothing"
        raise InputError("compare", found, f"two or more, each {_ACCEPTED}")
    paths = [folder.recording(place, _ACCEPTED) for place in places]
    recordings = [recording(path) for path in paths]
    first = recordings[0]
    for place, one in zip(places, recordings, strict=True):
        where = printable(place, 300)
        if not len(one):
            raise ProblemError(where, "the recording has no rows")
    if not traces.common(recordings):
        own = ", ".join(c.name for c in first.columns if c.name != TIME)
        accepted = f"All have to hold one of {own}, in the same unit."
        raise ProblemError("compare", "the recordings share no columns", accepted)
    names = _names(places)
    moves = [judging.moves(r) if judging.has_moves(r) else [] for r in recordings]
    return tuple(map(Side, names, paths, recordings, moves))


def _names(places: Sequence[Path]) -> list[str]:
    """Short names from the paths: "slow" and "quick" of results/slow and results/quick.

    Equal names are replaced by the whole path, equal paths are numbered.
    """
    short = [p.parent.name if p.name == folder.RECORDING else p.stem for p in places]
    alike = len(set(short)) < len(short) or not all(short)
    names = [printable(name, 300) for name in (places if alike else short)]
    return [
        f"{name} ({names[: k + 1].count(name)})" if names[:k].count(name) else name
        for k, name in enumerate(names)
    ]


def compare(sides: Sequence[Side]) -> Comparison:
    columns = tuple(traces.common([side.recording for side in sides]))
    moves = tuple(_match(move, sides) for move in sides[0].moves)
    partings = tuple(parting(sides[0].recording, s.recording, columns) for s in sides[1:])
    return Comparison(tuple(sides), columns, moves, partings)


def _match(move: MoveResult, sides: Sequence[Side]) -> Move:
    results = []
    for side in sides:
        same = next((m for m in side.moves if m.move == move.move), None)
        if same is not None and (
            same.stage != move.stage
            or not math.isclose(same.target, move.target, rel_tol=1e-9, abs_tol=1e-9)
        ):
            same = None
        results.append(same)
    return Move(move.move, move.stage, move.unit, move.target, tuple(results))


def content(found: Comparison) -> dict[str, Any]:
    first = found.sides[0].recording
    return {
        "version": macromicro.__version__,
        "recordings": [
            {
                "name": s.name,
                "file": str(s.path),
                "programme": s.recording.attributes.get("programme"),
                "seed": s.recording.attributes.get("seed"),
                "rows": len(s.recording),
                "period_s": s.recording.dt,
                "duration_s": round(len(s.recording) * s.recording.dt, 9),
                "moves": len(s.moves),
            }
            for s in found.sides
        ],
        "period_s": first.dt,
        "columns": {
            name: {
                "unit": first.unit(name),
                "rms_difference": [p.rms[name] for p in found.partings],
                "largest_difference": [p.largest[name] for p in found.partings],
                "largest_at_s": [p.at[name] for p in found.partings],
            }
            for name in found.columns
        },
        "first_difference": [
            {"rows": p.rows, "t_s": p.t, "columns": p.columns} for p in found.partings
        ],
        "structure": [
            {
                "compared_every_s": p.period,
                "only_first": p.lacking,
                "only_here": p.added,
                "units": p.units,
            }
            for p in found.partings
        ],
        "moves": [_as_row(move) for move in found.moves],
    }


def _as_row(move: Move) -> dict[str, Any]:
    told: dict[str, Any] = {
        "move": move.move, "stage": move.stage, "target": move.target, "unit": move.unit,
    }  # fmt: skip
    for quantity in QUANTITIES:
        told[quantity] = [None if r is None else getattr(r, quantity) for r in move.results]
        told[f"{quantity}_difference"] = [
            move.difference(quantity, k) for k in range(1, len(move.results))
        ]
    return told


def write(out: Path, found: Comparison, kinds: Sequence[str] = files.DEFAULT) -> None:
    """Write everything, all of it or nothing; an earlier comparison there is replaced.

    The figure shows the main columns, the page also all others that vary.
    """
    recordings = [side.recording for side in found.sides]
    labels = [side.name for side in found.sides]
    main = traces.default_columns(recordings)
    rest = [name for name in found.columns if name not in main and _varies(found, name)]
    with folder.staging(out, remove=FILES) as place:
        write_text(place / JSON, as_json(content(found)))
        write_text(place / PAGE, zoomable.page(recordings, [*main, *rest], labels))
        if kinds:
            figure = traces.overlay(*recordings, columns=main, labels=labels)
            files.save(figure, place, OVERLAY, kinds)


def _varies(found: Comparison, name: str) -> bool:
    """Whether a column varies in one of the recordings, or differs between them."""
    values = [side.recording[name] for side in found.sides]
    return any(bool(np.any(each != values[0][0])) for each in values)
