"""Measures a machine at the positions of a calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.calibration import targets
from macromicro.calibration.references import Instrument
from macromicro.calibration.targets import Visits
from macromicro.columns import Column
from macromicro.errors import MacromicroError
from macromicro.machines import composite, on_rig, open_rig, performing, planning, runs, tree
from macromicro.machines.composite import AnyMachine
from macromicro.machines.sequence import HOLDING
from macromicro.machines.stage import Kind
from macromicro.recording import Recording
from macromicro.rig.session import Fixture
from macromicro.simulate import Outcome

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
    empty: dict[str, object] = {tree.CORRECTION: {}}
    trees = [tree.with_correction(own, empty) for own in machine.trees(settings)]
    settings = composite.with_trees(machine, settings, trees)
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
    plane = isinstance(machine, composite.Composite) and machine.has_plane
    starts = targets.names(machine)
    true = ["true_x", "true_y"] if plane else [f"{start}true_position" for start in starts]
    kinds = composite.stages(machine).kinds
    plan = targets.plan_visits(machine, settings, visits)
    sink = _sink(machine, settings, kinds, performing.columns(machine), true)
    report = _reporting(plan, progress)
    outcome = performing.perform(
        machine, settings, plan, sink, seed=seed, progress=report, bench=bench
    )
    rests = _rests(sink, outcome, visits)
    scale = np.array([place.per for place in composite.places(machine)])
    random = np.random.default_rng([seed, 230])
    seen = reference.read(rests[:, 0], rests[:, -len(starts) :] / scale, random)
    return _readings(machine, kinds, visits, rests, seen)


def record(
    machine: AnyMachine,
    settings: Any,
    plan: planning.Planned,
    what: str,
    *,
    seed: int = 0,
    bench: Any = None,
    rigs: Sequence[Fixture] | None = None,
) -> Recording:
    """The recording of a plan that came to its end, on rigs or the simulated machine."""
    if rigs is None:
        how: dict[str, Any] = {"seed": seed, "warn": False, "bench": bench}
        done = runs.record(machine, settings, plan, **how)
    else:
        done = runs.record(machine, settings, plan, on=on_rig.open_rigs(rigs, seed))
    if done.outcome.fault is not None:
        raise MacromicroError(f"{what} were ended: {done.outcome.fault.text}")
    return done.recording


class Noting:
    """A rig that notes its reference beside what its stage shows."""

    def __init__(self, rig: Any) -> None:
        self._rig = rig
        self.notes: list[tuple[float, float]] = []  # time (s) and reference (m)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._rig, name)

    def read(self) -> Any:
        sample = self._rig.read()
        self.notes.append((sample.t, sample.laser))
        return sample

    def __enter__(self) -> Noting:
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
    rigs = [Noting(fixture.open(seed + k)) for k, fixture in enumerate(fixtures)]
    group = on_rig.Rigs(rigs, [fixture.rest for fixture in fixtures])
    kinds = open_rig.stages(composite.stages(machine), group.members).kinds
    plan = targets.plan_visits(machine, settings, visits)
    sink = _sink(machine, settings, kinds, performing.columns(machine, group.members), [])
    report = _reporting(plan, progress)
    outcome = on_rig.perform(machine, settings, plan, sink, group, report)
    rests = _rests(sink, outcome, visits)
    seen = [_at_rest(np.array(rig.notes), rests[:, 0], sink.last) for rig in rigs]
    return _readings(machine, kinds, visits, rests, np.stack(seen, axis=1))


def _at_rest(notes: Array, t: Array, last: float) -> Array:
    """Means of a reference about some times of the run, whose last time is `last`."""
    begun = notes[-1, 0] - last
    half = 0.5 * targets.REST
    means = []
    for now in t + begun:
        near = np.abs(notes[:, 0] - now) <= half
        means.append(float(np.nanmean(notes[near, 1])))
    return np.array(means)


SHOWN = ("position", "reading", "flank")  # of each stage, in the order of a sink's columns


def _warm(machine: AnyMachine, kinds: Sequence[Kind]) -> list[str]:
    """The columns of the stages' temperature sensors."""
    each = zip(targets.names(machine), kinds, strict=True)
    return [f"{start}temperature" for start, kind in each if "temperature" in kind.lines]


def _sink(
    machine: AnyMachine,
    settings: Any,
    kinds: Sequence[Kind],
    columns: Sequence[Column],
    more: Sequence[str],
) -> Rests:
    """Keeps what the stages show, then their temperatures, then other columns."""
    rows = {column.name: k for k, column in enumerate(columns)}
    shown = [f"{start}{name}" for name in SHOWN for start in targets.names(machine)]
    kept = [*shown, *_warm(machine, kinds), *more]
    return Rests(rows, composite.period(machine, settings), kept)


def _reporting(plan: planning.Planned, progress: Progress | None) -> Callable[[float, int], None]:
    count = len(planning.each(plan)[0].target)

    def reached(_: float, move: int) -> None:
        if progress is not None:
            progress(max(move, 0), count)

    return reached


def _rests(sink: Rests, outcome: Outcome, visits: Visits) -> Array:
    """The rests at the positions that count: a row each."""
    if outcome.fault is not None:
        raise MacromicroError(f"the calibration was ended: {outcome.fault.text}")
    found, keep = sink.close(), np.flatnonzero(visits.run > 0).tolist()
    missing = [k for k in keep if k not in found]
    if missing:
        raise MacromicroError(f"the calibration ended before position {missing[0] + 1}")
    return np.array([found[k] for k in keep])


def _readings(
    machine: AnyMachine, kinds: Sequence[Kind], visits: Visits, rests: Array, reference: Array
) -> Readings:
    keep = visits.run > 0
    scale = np.array([place.per for place in composite.places(machine)])
    count = len(scale)
    position, reading, flank = (
        rests[:, 1 + k * count : 1 + (k + 1) * count] for k in range(len(SHOWN))
    )
    nothing = np.full(len(rests), np.nan)
    degrees = rests[:, 1 + len(SHOWN) * count] if _warm(machine, kinds) else nothing
    return Readings(
        visits.run[keep], visits.direction[keep], rests[:, 0], visits.target[keep],
        position / scale, reading / scale, flank, reference, degrees,
    )  # fmt: skip
