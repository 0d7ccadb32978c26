"""`identify deadzone --test`: which test runs keep moving, and with a gain how far."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.identify.kinds import testing
from macromicro.identify.kinds.testing import Trial
from macromicro.identify.result import Line
from macromicro.identify.runs import Run
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from macromicro.identify.deadzone import DeadZone
    from macromicro.identify.deadzone import Trial as Outcome
    from macromicro.identify.discontinuity import DiscontinuousDeadZone

_NEXT = 1e-9  # V: what rounding does to a voltage


class Foretold(NamedTuple):
    file: str
    runs: tuple[Outcome, ...]
    right: int  # of how many the dead zone says so: that it moved on without a pause, or did not
    # positions, and those at the steady speed of (4.6); None: no gain was given
    trial: Trial | None

    def data(self) -> dict[str, Any]:
        told = {} if self.trial is None else testing.data([self.trial])[0]
        return {"file": self.file, "runs": len(self.runs), "right": self.right, **told}


def foretold(
    zone: DeadZone,
    law: DiscontinuousDeadZone | None,
    runs: Sequence[Run],
    file: str,
    pause: float,
) -> Foretold:
    """Prediction of test runs by the dead zone and, if known, (4.6)."""
    from macromicro.identify.deadzone import covered, tried

    if not runs:
        raise ProblemError(
            f"--test, {file}",
            "there is no stretch at a constant voltage other than 0",
            "Record open-loop runs, each at one voltage.",
        )
    outcomes = tried(runs, covered(runs, None), pause)
    right = sum(t.uninterrupted == _moves(zone, t.volts) for t in outcomes)
    return Foretold(file, outcomes, right, None if law is None else trial(law, runs, file))


def _moves(zone: DeadZone, volts: float) -> bool:
    return abs(volts) >= (zone.positive if volts > 0.0 else zone.negative) - _NEXT


def trial(law: DiscontinuousDeadZone, runs: Sequence[Run], file: str) -> Trial:
    """Test runs one after another, and the distance at the steady speed of (4.6)."""
    times: list[Array] = []
    model: list[Array] = []
    end = 0.0
    for run in runs:
        volts, t = float(run.u[0]), run.t - run.t[0]
        beyond = abs(volts) - law.width
        speed = law.speed(float(np.copysign(beyond, volts))) if beyond > 0.0 else 0.0
        model.append(run.x[0] + speed * t)
        times.append(t + end)
        end = float(times[-1][-1]) + run.dt
    measured = np.concatenate([run.x for run in runs])
    return Trial(file, np.concatenate(times), measured, np.concatenate(model))


def lines(seen: Sequence[Foretold], unit: str) -> list[Line]:
    """A line per file: runs that behave as predicted, and (4.6)."""
    made = []
    for k, one in enumerate(seen, 1):
        name = f"test {k}" if len(seen) > 1 else "test"
        share = 100.0 * one.right / len(one.runs)
        note = f"of {len(one.runs)} test runs behave as predicted: "
        made.append(Line(name, share, unit="%", note=note + printable(Path(one.file).name)))
    return made + testing.lines([one.trial for one in seen if one.trial is not None], unit)


def marks(seen: Sequence[Foretold]) -> list[tuple[str, Array, Array, str]]:
    made = []
    for moved, name, form in ((True, "moved on", "^"), (False, "paused", "x")):
        mine = [t for one in seen for t in one.runs if t.uninterrupted == moved]
        if mine:
            starts = np.array([t.start for t in mine])
            volts = np.array([abs(t.volts) for t in mine])
            made.append((f"not fitted: {name}", starts, volts, form))
    return made
