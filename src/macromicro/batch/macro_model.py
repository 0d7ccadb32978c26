"""The job "macro-model": the thesis' model of the macro-stage under its PD law, in lanes."""

from __future__ import annotations

import threading
from typing import Annotated, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.batch import course, lanes
from macromicro.batch.course import METRICS, SMALLEST
from macromicro.batch.variants import Trajectories, Variants, applied, checked, named, table
from macromicro.control import settings
from macromicro.control.macro import MacroLaw
from macromicro.control.pd import PdTuned
from macromicro.control.settings import Control
from macromicro.errors import InputError, ProblemError
from macromicro.kernel import compiled
from macromicro.models import macro
from macromicro.models.macro import TUNED, Linear, MacroModel, MacroModelState
from macromicro.nominal import COUNTS
from macromicro.schema.par import Par, entries

QUICK = ("overshoot", "iae", "final_error")
_FIXED_WIDE = 4096  # variants whose parameters are laid out at once
_law = settings.prepare(Control(macro_law="pd-tuned")).macro
_model = MacroModel()


class Pd(NamedTuple):
    """(4.10) with the dead-zone inverse and the saturation of the D/A board."""

    now: Annotated[float, Par("V/count", "weight of the present error", "(4.10)")] = _law.own.now
    before: Annotated[
        float, Par("V/count", "weight of the error one period ago", "(4.10), sign corrected")
    ] = _law.own.before
    dead_zone: Annotated[
        float, Par("V", "width that the inverse lifts by", "Section 4.2.3", lo=0.0)
    ] = _law.dead_zone
    limit: Annotated[float, Par("V", "largest effort", "Section 3.1", positive=True)] = _law.limit


class Model(NamedTuple):
    """(4.3)-(4.5) behind a saturation and a dead zone (Figure 4.14)."""

    a: Annotated[float, Par("1", "pole's coefficient of (4.3)", "(4.3)", lo=-1.0, hi=1.0)] = (
        _model.linear.a
    )
    b: Annotated[float, Par("count/(V*s)", "gain's coefficient of (4.3)", "(4.3)")] = (
        _model.linear.b
    )
    width: Annotated[float, Par("V", "width of the dead zone", "Figure 4.14", lo=0.0)] = (
        _model.width
    )
    a0: Annotated[float, Par("V", "jump at the dead zone's edge", "(4.5)", lo=0.0)] = _model.a0
    delta: Annotated[float, Par("1", "slope beyond it", "(4.5)", lo=0.0)] = _model.delta
    limit: Annotated[float, Par("V", "saturation of the model", "Section 4.2.1", positive=True)] = (
        _model.limit
    )


class MacroLoop(NamedTuple):
    """The loop: a step of `reference` from rest at 0, for `length`, a sample each `dt`."""

    controller: Pd = Pd()
    model: Model = Model()
    reference: Annotated[float, Par("count", "step", "whole travel (M16)")] = COUNTS
    dt: Annotated[float, Par("s", "sample time", "Section 3.3", shown="ms", positive=True)] = (
        _model.linear.dt
    )
    length: Annotated[float, Par("s", "length of the run", positive=True, hi=3600.0)] = 10.0


_PATHS = tuple(e.path for e in entries(MacroLoop()))
_TARGET, _DT, _LENGTH = (_PATHS.index(p) for p in ("reference", "dt", "length"))
_SCRATCH = threading.local()


class MacroModelJob:
    """Steps of the model, `lanes.WIDE` variants at a time."""

    name = "macro-model"
    block = lanes.WIDE

    def __init__(self, quick: bool = False, tree: MacroLoop | None = None) -> None:
        self._tree = MacroLoop() if tree is None else tree
        self._known = table(self._tree)
        self._base = np.array([[e.value] for e in self._known.values()])
        self._kernel = lanes.blocks_errors if quick else lanes.blocks
        names = QUICK if quick else tuple(m.name for m in METRICS)
        self._columns = [i for i, m in enumerate(METRICS) if m.name in names]
        self.metrics = tuple(METRICS[i] for i in self._columns)

    def base(self) -> MacroLoop:
        return self._tree

    def evaluate(self, variants: Variants, first: int = 0) -> Array:
        """Evaluate variants, bit for bit as `models.macro.closed_loop`."""
        compiled(self._kernel)  # once, before threads ask for it
        values = checked(self._known, variants, first)
        out = np.empty((len(values), len(self.metrics)))
        for k in range(0, len(values), _FIXED_WIDE):
            part = slice(k, min(k + _FIXED_WIDE, len(values)))
            self._fill(out[part], self._laid_out(variants.paths, values[part], first + k))
        return out

    def _laid_out(self, paths: tuple[str, ...], values: Array, first: int) -> Array:
        """All parameters, (`_PATHS`, n)."""
        every = np.empty((len(_PATHS), len(values)))
        every[:] = self._base
        for path, column in zip(paths, values.T, strict=True):
            every[_PATHS.index(path)] = column
        small = np.abs(every[_TARGET]) < SMALLEST
        if small.any():
            row = int(np.argmax(small))
            accepted = f"{SMALLEST:g} counts or more in either direction"
            where = named(first + row, "reference")
            raise InputError(where, f"{every[_TARGET, row]:g} count", accepted)
        few = every[_LENGTH] / every[_DT] < 1.5
        if few.any():
            row = int(np.argmax(few))
            accepted = f"at least two samples of {every[_DT, row]:g} s"
            raise InputError(named(first + row, "length"), f"{every[_LENGTH, row]:g} s", accepted)
        return every

    def _fill(self, out: Array, every: Array) -> None:
        """The metrics of the variants `every` into `out`, those of one length together."""
        samples = np.rint(every[_LENGTH] / every[_DT]).astype(np.int64)
        given = np.concatenate((every[: lanes.TASK], _judged(every[_TARGET])))
        for length in np.unique(samples):
            chosen = np.flatnonzero(samples == length)
            seen = np.empty((lanes.SHOWN, len(chosen)))
            here = np.ascontiguousarray(given[:, chosen])
            compiled(self._kernel)(_block(), here, seen, int(length))
            target, dt = every[_TARGET, chosen], every[_DT, chosen]
            found = course.measured(seen[1:], seen[0], target, int(length), dt)
            out[chosen] = found[:, self._columns]

    def trace(self, variants: Variants, every: int = 10, first: int = 0) -> Trajectories:
        values = checked(self._known, variants, first)
        laid = self._laid_out(variants.paths, values, first)
        lengths = laid[_LENGTH] / laid[_DT]
        if np.ptp(laid[_DT]) != 0.0 or np.ptp(np.rint(lengths)) != 0.0:
            raise ProblemError("trajectories", "their dt or length differs", "Give all the same.")
        aim = np.empty(round(lengths[0]))
        shown, out = np.empty((2, len(values), len(aim[::every]))), np.empty((2, len(aim)))
        for row, variant in enumerate(values):
            tree = applied(self._tree, variants.paths, variant, first + row)
            aim[:] = tree.reference
            model, law = single(tree)
            rest = MacroModelState(0.0, 0.0)
            compiled(macro.rollout)(model, law, rest, aim, True, out)
            shown[:, row] = out[:, ::every]
        t = np.arange(len(aim), step=every, dtype=np.float64) * float(laid[_DT, 0])
        columns = {"macro_position": shown[0], "motor": shown[1]}
        return Trajectories(t, columns, {"macro_position": "count", "motor": "V"})


def single(tree: MacroLoop) -> tuple[MacroModel, MacroLaw]:
    """Model and law of a single run of the loop."""
    m, c = tree.model, tree.controller
    model = MacroModel(Linear(m.a, m.b, tree.dt), TUNED, m.width, m.a0, m.delta, m.limit)
    law = _law.with_gains(PdTuned(c.now, c.before))
    law = law._replace(dead_zone=c.dead_zone, limit=c.limit)
    return model, law


def _judged(target: Array) -> Array:
    """`course.task` of each target, (3, n)."""
    if len(target) and (target == target[0]).all():
        return np.repeat(np.array([course.task(float(target[0]))]).T, len(target), axis=1)
    return np.array([course.task(float(t)) for t in target]).T


def _block() -> Array:
    if not hasattr(_SCRATCH, "block"):
        _SCRATCH.block = lanes.place()
    place: Array = _SCRATCH.block
    return place
