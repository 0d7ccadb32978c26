"""Two rigs on one clock: in step, or one moving while the other keeps its effort."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from types import TracebackType
from typing import Annotated, Any, NamedTuple, Self

import numpy as np

from macromicro.columns import Column, Quantity, whole
from macromicro.machines import lines, open_rig, runs
from macromicro.machines.joint import loop
from macromicro.machines.joint.loop import Bench, Plane
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.runs import Done, Outcome, about, laws, loops
from macromicro.machines.joint.settings import of
from macromicro.machines.runs import Blocks
from macromicro.machines.sequence import DONE
from macromicro.machines.stage import Kind
from macromicro.recording import Recording
from macromicro.rig.faults import ended
from macromicro.simulate import Sink
from macromicro.types import Outputs


class Unseen(NamedTuple):
    """The unknown true place of a rig's load."""

    x: Annotated[float, Quantity("mm", "true place along the axis", column="true", scale=1e3)]


def _unseen(params: Any, state: float) -> Unseen:
    return Unseen(float("nan"))


class Pair:
    """Two rigs on one clock."""

    def __init__(self, rigs: Sequence[Any]) -> None:
        self.rigs = tuple(rigs)
        self.together = False
        self.halves = tuple(Half(self, k) for k in range(len(self.rigs)))

    def wait(self, dt: float) -> None:
        for rig in self.rigs:
            rig.clock.wait(dt)


class Half:
    """One of two rigs on one clock, as a `Rig`."""

    def __init__(self, pair: Pair, k: int) -> None:
        self._pair, self._rig, self._last = pair, pair.rigs[k], k == len(pair.rigs) - 1
        self.channels = tuple(self._rig.channels)
        self.outputs = tuple(getattr(self._rig, "outputs", ()))
        self.clock = self

    def now(self) -> float:
        return float(self._rig.clock.now())

    def wait(self, dt: float) -> None:
        """Wait for the next period; in step, only the second one waits."""
        if self._last or not self._pair.together:
            self._pair.wait(dt)

    def read(self) -> Any:
        return self._rig.read()

    def write(self, outputs: Outputs) -> None:
        self._rig.write(outputs)

    def idle(self, seconds: float) -> None:
        """Let time pass with safe outputs."""
        self._rig.idle(seconds)

    def stop(self) -> None:
        self._rig.stop()

    def __enter__(self) -> Self:
        self._rig.__enter__()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._rig.__exit__(kind, error, trace)


def record(
    machine: Joint, settings: Any, plan: JointPlan, on: tuple[Any, Any], title: str = ""
) -> Done:
    """Run a plan on two rigs in step, in memory."""
    blocks, there = Blocks(), columns(machine, on)
    blocks.append(np.empty((len(there), 0)))
    outcome = driven(machine, settings, plan, on, blocks)
    attributes = about(machine, settings, title, seed=0)
    attributes |= ended(outcome.finished, outcome.fault)
    rows = np.concatenate(blocks.blocks, axis=1)
    dt = settings.x.timing.period
    return Done(Recording.from_arrays(there, rows, dt, attributes), outcome)


def kinds(on: Sequence[Any]) -> tuple[Kind, Kind]:
    """The kinds of open rigs."""
    first, second = (open_rig.of(rig)._replace(truth=Unseen, show=_unseen) for rig in on)
    return first, second


def opened(settings: Any, on: Sequence[Any]) -> Bench:
    first, second = (
        open_rig.opened(rig, own.encoder.pitch) for rig, own in zip(on, of(settings), strict=True)
    )
    return Bench(first, second, Plane(0.0, 1.0))


def stopped(on: Sequence[Any]) -> None:
    """Set all outputs of both to safe values, whatever one of them raises."""
    with ExitStack() as each:
        for rig in on:
            each.callback(rig.stop)


def columns(machine: Joint, on: Sequence[Any]) -> tuple[Column, ...]:
    return loop.columns(kinds(on), laws(machine))


def driven(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    on: tuple[Any, Any],
    sink: Sink,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on two rigs in step, drives enabled first, and append every period to a sink."""
    both, dt = kinds(on), settings.x.timing.period
    bench = opened(settings, on)
    control, under = loops(settings, plan), laws(machine)
    period, rows = loop.period(both, under), loop.columns(both, under)
    longest = max(runs.longest(own, p) for own, p in zip(of(settings), plan.plans, strict=True))
    chunk = runs.LIVE
    nothing = tuple(np.empty((chunk, kind.noises)) for kind in both)
    try:
        rise = max(lines.rise(own) for own in of(settings))
        open_rig.switched_on(bench[:2], both, rise, dt)
        run = loop.beginning(both, under, bench, control)
        while run.tick < round(longest / dt) and not run.over:
            block = np.empty((len(rows), chunk))
            run, written = period(bench, control, run, nothing, block, dt)
            sink.append(whole(block[:, :written], rows))
            if progress is not None:
                progress(run.tick * dt, run.joined.progress.move)
    finally:
        stopped(on)
    done = run.joined.progress.phase == DONE
    return Outcome(done, (run.first.watch, run.second.watch), run.tick * dt)
