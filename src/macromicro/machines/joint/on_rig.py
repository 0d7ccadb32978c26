"""Two rigs on one clock: each alone while the other keeps its effort, or both in step."""

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
from macromicro.simulate import Sink
from macromicro.types import Outputs


class Unseen(NamedTuple):
    """Where a rig's load truly is: nobody knows."""

    x: Annotated[float, Quantity("mm", "true place along the axis", column="true", scale=1e3)]


def _unseen(params: Any, state: float) -> Unseen:
    return Unseen(float("nan"))


class Pair:
    """Two rigs whose time passes at once.

    Parameters
    ----------
    rigs : Sequence[Any]
        Of each axis, at rest, of one control period; their clocks wait for it.

    Attributes
    ----------
    together : bool
        Whether both are driven in the same period: then the second's wait lets time pass. Else the
        wait of either does, and the other keeps its last effort.
    """

    def __init__(self, rigs: Sequence[Any]) -> None:
        self.rigs = tuple(rigs)
        self.together = False
        self.halves = tuple(Half(self, k) for k in range(len(self.rigs)))

    def wait(self, dt: float) -> None:
        """Let a period pass on both.

        Parameters
        ----------
        dt : float
            Their control period, s.
        """
        for rig in self.rigs:
            rig.clock.wait(dt)


class Half:
    """One of two rigs on one clock, as a `Rig`.

    Parameters
    ----------
    pair : Pair
        Both.
    k : int
        Which.
    """

    def __init__(self, pair: Pair, k: int) -> None:
        self._pair, self._rig, self._last = pair, pair.rigs[k], k == len(pair.rigs) - 1
        self.channels = tuple(self._rig.channels)
        self.outputs = tuple(getattr(self._rig, "outputs", ()))
        self.clock = self

    def now(self) -> float:
        """Time since the start.

        Returns
        -------
        float
            s.
        """
        return float(self._rig.clock.now())

    def wait(self, dt: float) -> None:
        """Return when the next period begins; in step, for the second alone.

        Parameters
        ----------
        dt : float
            Its length, s.
        """
        if self._last or not self._pair.together:
            self._pair.wait(dt)

    def read(self) -> Any:
        """This period's sample.

        Returns
        -------
        Any
            Of this axis.
        """
        return self._rig.read()

    def write(self, outputs: Outputs) -> None:
        """Set this axis' outputs.

        Parameters
        ----------
        outputs : Outputs
            For the coming period, and until others are written.
        """
        self._rig.write(outputs)

    def idle(self, seconds: float) -> None:
        """Let time pass on this rig, a session, with its outputs safe.

        Parameters
        ----------
        seconds : float
            Duration, s.
        """
        self._rig.idle(seconds)

    def stop(self) -> None:
        """Set every output of this axis to its safe value."""
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
    """A plan on two rigs in step, in memory, under the laws and guards of both axes.

    Parameters
    ----------
    machine : Joint
        Whose laws and guards drive them.
    settings : Any
        Its settings.
    plan : JointPlan
        From where both stand, 0.
    on : tuple[Rig, Rig]
        Entered; halves of one `Pair`, in step.
    title : str, optional
        Of the programme.

    Returns
    -------
    Done
        The recording, whose true places are NaN, and how it ended; both rigs are stopped.
    """
    blocks, there = Blocks(), columns(machine, on)
    blocks.append(np.empty((len(there), 0)))
    outcome = driven(machine, settings, plan, on, blocks)
    attributes = about(machine, settings, title, seed=0)
    rows = np.concatenate(blocks.blocks, axis=1)
    dt = settings.x.timing.period
    return Done(Recording.from_arrays(there, rows, dt, attributes), outcome)


def kinds(on: Sequence[Any]) -> tuple[Kind, Kind]:
    """The kinds of stages that open rigs are, as a period of both shows them.

    Parameters
    ----------
    on : Sequence[Rig]
        Of each axis.

    Returns
    -------
    tuple[Kind, Kind]
        For `opened`.
    """
    first, second = (open_rig.of(rig)._replace(truth=Unseen, show=_unseen) for rig in on)
    return first, second


def opened(settings: Any, on: Sequence[Any]) -> Bench:
    """Open rigs as the stages of a machine.

    Parameters
    ----------
    settings : Any
        Of the machine.
    on : Sequence[Rig]
        Of each axis.

    Returns
    -------
    Bench
        Of the places along each axis; nobody knows how square they stand.
    """
    first, second = (
        open_rig.opened(rig, own.encoder.pitch) for rig, own in zip(on, of(settings), strict=True)
    )
    return Bench(first, second, Plane(0.0, 1.0))


def stopped(on: Sequence[Any]) -> None:
    """Set every output of both to its safe value, of either whatever the other one raises.

    Parameters
    ----------
    on : Sequence[Rig]
        Of each axis.
    """
    with ExitStack() as each:
        for rig in on:
            each.callback(rig.stop)


def columns(machine: Joint, on: Sequence[Any]) -> tuple[Column, ...]:
    """What a run on two rigs records.

    Parameters
    ----------
    machine : Joint
        Whose laws drive them.
    on : Sequence[Rig]
        Of each axis.

    Returns
    -------
    tuple[Column, ...]
        In the order of the rows.
    """
    return loop.columns(kinds(on), laws(machine))


def driven(
    machine: Joint,
    settings: Any,
    plan: JointPlan,
    on: tuple[Any, Any],
    sink: Sink,
    progress: Callable[[float, int], None] | None = None,
) -> Outcome:
    """Run a plan on two rigs in step and append every period to a sink; both are stopped then.

    Drives with an enable line are switched on first, and waited for until the slower gives current.

    Parameters
    ----------
    machine : Joint
        Whose laws and guards drive them.
    settings : Any
        Its settings.
    plan : JointPlan
        From where both stand.
    on : tuple[Rig, Rig]
        Entered; halves of one `Pair`, in step.
    sink : Sink
        Takes blocks of shape (columns, rows).
    progress : Callable[[float, int], None] | None, optional
        As for `runs.perform`.

    Returns
    -------
    Outcome
        How it ended.
    """
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
