"""`--test FILE`: what was found, on a record that was not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.kinds.loading import Picking, alike, loaded, there
from macromicro.identify.picking import Picked, Role
from macromicro.identify.result import Line
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from macromicro.identify.axis_fit import DriveFit
    from macromicro.identify.presliding_fit import PreslidingFit
    from macromicro.identify.runs import Run

_SHOWN = 3  # records in a figure


class Trial(NamedTuple):
    """A record that was not fitted, and what the model makes of it.

    Attributes
    ----------
    file : str
        Its name.
    t : ndarray, shape (n,)
        Time, or what it is drawn over.
    measured : ndarray, shape (n,)
        The output.
    model : ndarray, shape (n,)
        The output by the model, from the input alone.
    """

    file: str
    t: Array
    measured: Array
    model: Array

    @property
    def rms(self) -> float:
        """RMS of the difference, in the output's unit."""
        return float(np.sqrt(np.mean((self.measured - self.model) ** 2)))

    @property
    def percent(self) -> float:
        """Fit in percent; 100 is perfect, NaN for an output that stays."""
        extent = float(np.std(self.measured))
        return 100.0 * (1.0 - self.rms / extent) if extent > 0.0 else float("nan")


def unseen(
    tests: Sequence[str], what: Picking, roles: Sequence[Role], first: Picked
) -> list[Picked]:
    """The columns of records that were not fitted, in the units of those that were.

    Parameters
    ----------
    tests : Sequence[str]
        Files.
    what : Picking
        Of the fit; its columns are taken from these files as well.
    roles : Sequence[Role]
        What the kind needs.
    first : Picked
        A record that was fitted.

    Returns
    -------
    list[Picked]
        One per file.

    Raises
    ------
    InputError
        A file cannot be read, was fitted, lacks a column, or has other units.
    """
    if not tests:
        return []
    fitted = {file.resolve() for file in what.files}
    for name in tests:
        if Path(name).resolve() in fitted:
            raise InputError("--test", printable(name, 300), "a record that is not fitted")
    found = loaded(Picking(there(list(tests)), what.columns), roles)
    for table in found:
        alike(table, first)
    return found


def driven(fit: DriveFit | PreslidingFit, run: Run, file: str) -> Trial:
    """A free run of an axis over a record that was not fitted, from its measured start.

    Parameters
    ----------
    fit : DriveFit | PreslidingFit
        What was found.
    run : Run
        The record.
    file : str
        Its name.

    Returns
    -------
    Trial
        Measured and simulated positions.
    """
    from macromicro.identify.axis_fit import start

    x, v = start(run, fit.gain, fit.delay)
    return Trial(file, run.t, run.x, fit.simulate(run.u, run.dt, x, v))


def lines(trials: Sequence[Trial], unit: str) -> list[Line]:
    """A line of the table for each record that was not fitted.

    Parameters
    ----------
    trials : Sequence[Trial]
        The records.
    unit : str
        Of the output.

    Returns
    -------
    list[Line]
        Fit in percent.
    """
    return [
        Line(
            f"test {k}" if len(trials) > 1 else "test",
            one.percent,
            unit="%",
            note=f"free run, not fitted: RMS {one.rms:.3g} {unit} over {len(one.t)} samples of "
            f"{printable(Path(one.file).name)}",
        )
        for k, one in enumerate(trials, 1)
    ]


def data(trials: Sequence[Trial]) -> list[dict[str, Any]]:
    """The same for result.json.

    Parameters
    ----------
    trials : Sequence[Trial]
        The records.

    Returns
    -------
    list[dict[str, Any]]
        One for each.
    """
    return [
        {"file": one.file, "fit_percent": one.percent, "rms": one.rms, "samples": len(one.t)}
        for one in trials
    ]


def drawn(
    t: Sequence[Array],
    measured: Sequence[Array],
    model: Sequence[Array],
    trials: Sequence[Trial],
    label: str,
) -> Figure:
    """Free runs over records that were fitted, and beside them over those that were not.

    Parameters
    ----------
    t, measured, model : Sequence[Array]
        Of the records that were fitted, shape (n,) each.
    trials : Sequence[Trial]
        Those that were not.
    label : str
        Of the output, with its unit.

    Returns
    -------
    Figure
        Of three records at most, one of which was fitted.
    """
    from macromicro.identify.kinds import pictures

    if not trials:
        return pictures.free_runs(t, measured, model, label)
    tests = list(trials[: _SHOWN - 1])
    kept = min(len(t), _SHOWN - len(tests))
    names = [f"fitted, {k + 1} of {len(t)}" if len(t) > 1 else "fitted" for k in range(kept)]
    names += [f"not fitted: {printable(Path(one.file).name, 30)}" for one in tests]
    return pictures.free_runs(
        [*t[:kept], *(one.t for one in tests)],
        [*measured[:kept], *(one.measured for one in tests)],
        [*model[:kept], *(one.model for one in tests)],
        label,
        names=names,
    )
