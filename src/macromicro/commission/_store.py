"""Results of steps on disk: a JSON file each, or a recording."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

import macromicro
from macromicro.columns import Column
from macromicro.commission import _verifying
from macromicro.commission.procedure import Kind, Step
from macromicro.commission.stand import Record
from macromicro.errors import InputError, ProblemError
from macromicro.recording import Recording
from macromicro.schema.text import printable

FOLDER = "steps"
COLUMNS = (
    Column("t", "s", "time since the record began"),
    Column("u", "V", "effort"),
    Column("x", "m", "position by the encoder"),
    Column("stroke", "1", "number of the record", "i4"),
)


def file(step: Step) -> str:
    return f"{step.name}.h5" if step.result is None else f"{FOLDER}-{step.name}.json"


def keep(folder: Path, step: Step, found: Any, dt: float, asked: dict[str, Any]) -> None:
    place = folder / file(step)
    if step.result is None:
        every = [np.array([r.t, r.u, r.x, np.full(len(r.t), k)]) for k, r in enumerate(found)]
        rows = np.concatenate([np.empty((len(COLUMNS), 0)), *every], axis=1)
        attributes = {"version": macromicro.__version__, "asked": json.dumps(asked)}
        Recording.from_arrays(COLUMNS, rows, dt, attributes).save(place, overwrite=True)
        return
    text = json.dumps({"asked": asked, "found": found._asdict()}, indent=1)
    part = place.with_suffix(".part")
    part.write_text(text + "\n", encoding="utf-8")
    os.replace(part, place)


def read_steps(folder: Path, kind: Kind, asked: dict[str, Any]) -> dict[str, Any]:
    """Results of earlier sessions up to the first missing step."""
    found: dict[str, Any] = {}
    for step in _verifying.kept_steps(kind):
        place = folder / file(step)
        if not place.is_file():
            return found
        found[step.name] = (_records if step.result is None else _values)(place, step, asked)
    return found


def _values(place: Path, step: Step, asked: dict[str, Any]) -> Any:
    where = printable(place, 300)
    try:
        text = json.loads(place.read_text(encoding="utf-8"))
        before, values = text["asked"], text["found"]
        made = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
        result = step.result(**made)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        remedy = "Delete the file to repeat the step."
        raise ProblemError(where, f"the step's result is damaged: {error}", remedy) from None
    _same(where, before, asked)
    return result


def _records(place: Path, step: Step, asked: dict[str, Any]) -> list[Record]:
    kept = Recording.load(place)
    _same(printable(place, 300), json.loads(str(kept.attributes["asked"])), asked)
    return records(kept)


def records(kept: Recording) -> list[Record]:
    if not len(kept["stroke"]):
        return []
    cuts = np.flatnonzero(np.diff(kept["stroke"])) + 1
    columns = [np.split(np.asarray(kept[c], float), cuts) for c in ("t", "u", "x")]
    return [Record(*one) for one in zip(*columns, strict=True)]


def _same(where: str, before: dict[str, Any], asked: dict[str, Any]) -> None:
    for key, value in asked.items():
        if key not in before and not value:  # an option that came later, as it was before
            continue
        was = before.get(key)
        near = isinstance(was, float) and math.isclose(was, value, rel_tol=1e-9)
        if was != value and not near:
            accepted = f"{was!r}, as when this commissioning began, or --overwrite to start again"
            raise InputError(f"{where}, {key}", value, accepted)
