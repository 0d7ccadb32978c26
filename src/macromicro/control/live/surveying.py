"""The survey with its state in compiled code, for real time; bit for bit as `survey.look`."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from macromicro.arrays import Array, packed
from macromicro.control.live import edges, survey
from macromicro.control.live.edges import Phase
from macromicro.control.live.parameters import Edges
from macromicro.control.live.survey import NOTHING, Moving, Survey
from macromicro.kernel import compiled, kernel
from macromicro.types import Sample

_PHASE = len(Phase._fields)
_FIELDS = _PHASE + len(Survey._fields) - 1
_LOOK, _TAKE = 0.0, 1.0
_MOVING = 4  # place in what is asked; before it the order, encoder, Hall sensor and laser
_ASKED = packed(_MOVING + len(Moving._fields))


@kernel
def _store(v: Survey, row: Array) -> None:
    phase, rest = v.phase, v[1:]
    for k in range(_PHASE):
        row[k] = phase[k]  # type: ignore[index]
    for k in range(len(rest)):
        row[_PHASE + k] = rest[k]


@kernel
def _restored(r: Array) -> Survey:
    e = Phase(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7])
    return Survey(
        e, r[8], r[9], r[10], r[11], r[12], r[13], r[14], r[15], r[16], r[17], r[18],
        r[19], r[20], r[21], r[22], r[23], r[24], r[25],
    )  # fmt: skip


def _survey(q: Edges, pitch: float, asked: Array, state: Array, dt: float) -> Iterator[int]:
    """The survey as a coroutine: each `next` reads `state` or processes a sample."""
    v = _restored(state)
    while True:
        if asked[0] == _LOOK:
            nan = math.nan
            sample = Sample(nan, asked[1], asked[2], asked[3], nan, nan)
            moving = Moving(asked[4], asked[5], asked[6], asked[7])
            v = survey.followed(q, pitch, v, sample, moving, dt)
            _store(v, state)
        else:
            v = _restored(state)
        yield 0


class Surveying:
    def __init__(self, q: Edges, pitch: float, dt: float) -> None:
        self._begin(q, pitch, dt)

    def _begin(self, q: Edges, pitch: float, dt: float) -> None:
        self._asked = np.zeros(_MOVING + len(Moving._fields))
        self._state = np.zeros(_FIELDS)
        self._last: Survey = NOTHING
        self._kept = (q, pitch, dt)
        _store(NOTHING._replace(phase=edges.unknown()), self._state)
        # The coroutine refers to the arrays inside, and does not own them.
        self._survey = compiled(_survey)(q, pitch, self._asked, self._state, dt)

    def __call__(
        self, q: Edges, pitch: float, v: Survey, sample: Sample, moving: Moving, dt: float
    ) -> Survey:
        if (q, pitch, dt) != self._kept:
            self._begin(q, pitch, dt)
        asked = self._asked
        if v is not self._last:
            _store(v if v.phase else v._replace(phase=edges.unknown()), self._state)
            asked[0] = _TAKE
            next(self._survey)
        _ASKED.pack_into(asked.data, 0, _LOOK, sample.encoder, sample.hall, sample.laser, *moving)
        next(self._survey)
        row = self._state.tolist()
        phase = Phase(*row[:_PHASE])
        self._last = v = Survey(phase if edges.known(phase) else None, *row[_PHASE:])
        return v
