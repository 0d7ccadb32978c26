"""`identify deadzone --test`: which runs that were not fitted move on, and with a gain how far."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
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
    """Runs of a file that was not fitted, and what the dead zone says of them.

    Attributes
    ----------
    file : str
        Its name.
    runs : tuple[Outcome, ...]
        What became of each run.
    right : int
        Of how many the dead zone says so: that it moved on without a pause, or did not.
    trial : Trial | None
        Positions, and those at the steady speed of (4.6); None: no gain was given.
    """

    file: str
    runs: tuple[Outcome, ...]
    right: int
    trial: Trial | None

    def data(self) -> dict[str, Any]:
        """The same for result.json.

        Returns
        -------
        dict[str, Any]
            File, runs, how many went as told; fit and RMS with a gain.
        """
        told = {} if self.trial is None else testing.data([self.trial])[0]
        return {"file": self.file, "runs": len(self.runs), "right": self.right, **told}


def foretold(
    zone: DeadZone,
    law: DiscontinuousDeadZone | None,
    runs: Sequence[Run],
    file: str,
    pause: float,
) -> Foretold:
    """What the dead zone, and (4.6) where it is known, say of runs that were not fitted.

    Parameters
    ----------
    zone : DeadZone
        As found.
    law : DiscontinuousDeadZone | None
        (4.5), where a gain was given.
    runs : Sequence[Run]
        Of one voltage each.
    file : str
        Where they are from.
    pause : float
        A longer time without a new count is an interruption, s.

    Returns
    -------
    Foretold
        Of this file.

    Raises
    ------
    InputError
        The file has no run at a constant voltage.
    """
    from macromicro.identify.deadzone import covered, tried

    if not runs:
        found = "no stretch at a constant voltage other than 0"
        raise InputError(f"--test, {file}", found, "open-loop runs, each at one voltage")
    outcomes = tried(runs, covered(runs, None), pause)
    right = sum(t.uninterrupted == _moves(zone, t.volts) for t in outcomes)
    return Foretold(file, outcomes, right, None if law is None else trial(law, runs, file))


def _moves(zone: DeadZone, volts: float) -> bool:
    """Whether a voltage is beyond the dead zone of its direction."""
    return abs(volts) >= (zone.positive if volts > 0.0 else zone.negative) - _NEXT


def trial(law: DiscontinuousDeadZone, runs: Sequence[Run], file: str) -> Trial:
    """Runs one after another, and the way at the steady speed of (4.6) from each one's start.

    Parameters
    ----------
    law : DiscontinuousDeadZone
        (4.5).
    runs : Sequence[Run]
        Of one voltage each.
    file : str
        Where they are from.

    Returns
    -------
    Trial
        Within the dead zone the model stands.
    """
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
    """A line for each file: how many of its runs went as the dead zone says, and (4.6).

    Parameters
    ----------
    seen : Sequence[Foretold]
        The files.
    unit : str
        Of positions.

    Returns
    -------
    list[Line]
        Shares in percent.
    """
    made = []
    for k, one in enumerate(seen, 1):
        name = f"test {k}" if len(seen) > 1 else "test"
        share = 100.0 * one.right / len(one.runs)
        note = f"of {len(one.runs)} runs, not fitted, move on or not as told: "
        made.append(Line(name, share, unit="%", note=note + printable(Path(one.file).name)))
    return made + testing.lines([one.trial for one in seen if one.trial is not None], unit)


def marks(seen: Sequence[Foretold]) -> list[tuple[str, Array, Array, str]]:
    """Starts and voltages of the runs that were not fitted, for the figure of thresholds.

    Parameters
    ----------
    seen : Sequence[Foretold]
        The files.

    Returns
    -------
    list[tuple[str, Array, Array, str]]
        Those that moved on and those that paused, where there are any.
    """
    made = []
    for moved, name, form in ((True, "moved on", "^"), (False, "paused", "x")):
        mine = [t for one in seen for t in one.runs if t.uninterrupted == moved]
        if mine:
            starts = np.array([t.start for t in mine])
            volts = np.array([abs(t.volts) for t in mine])
            made.append((f"not fitted: {name}", starts, volts, form))
    return made
