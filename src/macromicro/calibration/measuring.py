"""Measures a machine at the positions of a calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.calibration import targets
from macromicro.calibration.references import Instrument
from macromicro.calibration.targets import Visits
from macromicro.errors import MacromicroError
from macromicro.machines import composite, on_rig, planning, runs, tree
from macromicro.machines.composite import AnyMachine
from macromicro.machines.sequence import HOLDING
from macromicro.rig.session import Fixture

Progress = Callable[[int, int], None]


class Readings(NamedTuple):
    """One row a rest, one column a stage where there are columns."""

    run: Array
    direction: Array  # 1: from below, -1: from above
    t: Array  # s
    target: Array  # m
    position: Array  # m, as the machine knows it
    reading: Array  # m, of the stage's own sensor, not corrected
    flank: Array  # of the drive: 1 the upper one, 0 the lower
    reference: Array  # m, of the reference
    temperature: Array  # degC; NaN: not measured

    @property
    def deviation(self) -> Array:
        """Reference less target, m."""
        return np.asarray(self.reference - self.target)


class Rests:
    """A sink that keeps the means of the last part of each hold."""

    def __init__(self, rows: dict[str, int], dt: float, measured: Sequence[str]) -> None:
        self._rows, self._measured = rows, [rows[name] for name in measured]
        self._last = max(round(targets.REST / dt), 1)
        self._blocks: list[Array] = []
        self.move = -1
        self.found: dict[int, Array] = {}  # by move: time, then what is measured
        self.last = 0.0  # time of the last row, s

    def append(self, block: Array) -> None:
        rows = self._rows
        if block.shape[1]:
            self.last = float(block[rows["t"], -1])
        held = block[:, block[rows["phase"]] == HOLDING]
        for move in np.unique(held[rows["move"]]).astype(int).tolist():
            own = held[:, held[rows["move"]] == move]
            if move != self.move:
                self._close()
                self.move = move
            self._blocks.append(own[[rows["t"], *self._measured]])

    def _close(self) -> None:
        if self._blocks:
            whole = np.concatenate(self._blocks, axis=1)
            self.found[self.move] = whole[:, -self._last :].mean(axis=1)
        self._blocks = []

    def close(self) -> dict[int, Array]:
        self._close()
        return self.found


def ready(machine: AnyMachine, settings: Any) -> tuple[AnyMachine, Any]:
    """The machine with a correction of nothing where it has none, so that it shows its readings."""
    if isinstance(machine, composite.Composite):
        changed = {
            name: tree.with_correction(own, {tree.CORRECTION: {}})
            for (name, _), own in zip(machine.stages, machine.trees(settings), strict=True)
        }
        settings = settings._replace(**changed)
    else:
        settings = tree.with_correction(settings, {tree.CORRECTION: {}})
    return composite.under(machine, settings), settings


def measure(
    machine: AnyMachine,
    settings: Any,
    visits: Visits,
    reference: Instrument,
    *,
    bench: Any = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Readings:
    """Go to each position on the simulated machine and read sensor and reference there."""
    plan = targets.planned(machine, settings, visits)
    starts = targets.names(machine)
    plane = isinstance(machine, composite.Composite) and machine.has_plane
    true = ["true_x", "true_y"] if plane else [f"{start}true_position" for start in starts]
    rests = _performed(machine, settings, plan, true, bench=bench, seed=seed, progress=progress)
    keep = np.flatnonzero(visits.run > 0)
    missing = [k for k in keep.tolist() if k not in rests]
    if missing:
        raise MacromicroError(f"the calibration ended before position {missing[0] + 1}")
    rows = np.array([rests[k] for k in keep.tolist()])
    scale = np.array([place.per for place in composite.places(machine)])
    count = len(starts)
    t, own = rows[:, 0], rows[:, 1:]
    random = np.random.default_rng([seed, 230])
    seen = reference.read(t, own[:, 3 * count : 4 * count] / scale, random)
    return Readings(
        visits.run[keep],
        visits.direction[keep],
        t,
        visits.target[keep],
        own[:, :count] / scale,
        own[:, count : 2 * count] / scale,
        own[:, 2 * count : 3 * count],
        seen,
        own[:, 4 * count],
    )


class Noted:
    """A rig whose reference is noted beside what its stage shows."""

    def __init__(self, rig: Any) -> None:
        self._rig = rig
        self.noted: list[tuple[float, float]] = []  # time (s) and reference (m)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)

    def read(self) -> Any:
        sample = self._rig.read()
        self.noted.append((sample.t, sample.laser))
        return sample

    def __enter__(self) -> Noted:
        self._rig.__enter__()
        return self

    def __exit__(self, *error: Any) -> None:
        self._rig.__exit__(*error)


def on_rigs(
    machine: AnyMachine,
    settings: Any,
    visits: Visits,
    fixtures: Sequence[Fixture],
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> Readings:
    """Go to each position on rigs that have a reference beside their encoder."""
    plan, starts = targets.planned(machine, settings, visits), targets.names(machine)
    rigs = [Noted(fixture.open(seed + k)) for k, fixture in enumerate(fixtures)]
    group = on_rig.Rigs(rigs)
    names = [column.name for column in runs.columns(machine, group.members)]
    rows = {name: k for k, name in enumerate(names)}
    measured = [f"{s}{name}" for name in ("position", "reading", "flank") for s in starts]
    sink = Rests(rows, composite.period(machine, settings), measured)
    count = len(planning.each(plan)[0].target)

    def reached(_: float, move: int) -> None:
        if progress is not None:
            progress(max(move, 0), count)

    rests = [fixture.rest for fixture in fixtures]
    outcome = on_rig.perform(machine, settings, plan, sink, group, rests, reached)
    if outcome.fault is not None:
        raise MacromicroError(f"the calibration was ended: {outcome.fault.text}")
    found = sink.close()
    keep = np.flatnonzero(visits.run > 0)
    own = np.array([found[k] for k in keep.tolist()])
    scale, width = np.array([place.per for place in composite.places(machine)]), len(starts)
    references = np.stack(
        [_at_rest(np.array(rig.noted), own[:, 0], sink.last) for rig in rigs], axis=1
    )
    return Readings(
        visits.run[keep],
        visits.direction[keep],
        own[:, 0],
        visits.target[keep],
        own[:, 1 : 1 + width] / scale,
        own[:, 1 + width : 1 + 2 * width] / scale,
        own[:, 1 + 2 * width : 1 + 3 * width],
        references,
        np.full(len(own), np.nan),
    )


def _at_rest(noted: Array, t: Array, last: float) -> Array:
    """Means of a reference about some times of the run, whose last time is `last`."""
    begun = noted[-1, 0] - last
    half = 0.5 * targets.REST
    means = []
    for now in t + begun:
        near = np.abs(noted[:, 0] - now) <= half
        means.append(float(np.nanmean(noted[near, 1])))
    return np.array(means)


def _performed(
    machine: AnyMachine,
    settings: Any,
    plan: planning.Planned,
    true: Sequence[str],
    *,
    bench: Any,
    seed: int,
    progress: Progress | None,
) -> dict[int, Array]:
    starts = targets.names(machine)
    names = [column.name for column in runs.columns(machine)]
    rows = {name: k for k, name in enumerate(names)}
    kinds = composite.stages(machine).kinds
    warm = [
        f"{start}temperature"
        for start, kind in zip(starts, kinds, strict=True)
        if "temperature" in kind.lines
    ]
    measured = [f"{s}{name}" for name in ("position", "reading", "flank") for s in starts]
    # Without a sensor of temperature, a column of no meaning stands in and is made NaN below.
    sink = Rests(rows, composite.period(machine, settings), [*measured, *true, *(warm or ["t"])])
    count = len(planning.each(plan)[0].target)

    def reached(_: float, move: int) -> None:
        if progress is not None:
            progress(max(move, 0), count)

    outcome = runs.perform(machine, settings, plan, sink, seed=seed, progress=reached, bench=bench)
    if outcome.fault is not None:
        raise MacromicroError(f"the calibration was ended: {outcome.fault.text}")
    found = sink.close()
    if not warm:
        for row in found.values():
            row[-1] = np.nan
    return found
