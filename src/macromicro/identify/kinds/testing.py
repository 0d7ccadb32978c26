"""`--test FILE`: the result on a record that was not fitted."""

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
    file: str
    t: Array  # time, or what it is drawn over
    measured: Array  # the output
    model: Array  # the output by the model, from the input alone

    @property
    def rms(self) -> float:
        return float(np.sqrt(np.mean((self.measured - self.model) ** 2)))

    @property
    def percent(self) -> float:
        """Fit in percent; 100 is perfect, NaN for a constant output."""
        extent = float(np.std(self.measured))
        return 100.0 * (1.0 - self.rms / extent) if extent > 0.0 else float("nan")


def unseen(
    tests: Sequence[str], what: Picking, roles: Sequence[Role], first: Picked
) -> list[Picked]:
    """Columns of test records, in the units of the fitted ones."""
    if not tests:
        return []
    refuse_fitted(tests, what)
    found = loaded(Picking(there(list(tests)), what.columns), roles)
    for table in found:
        alike(table, first.units, first.file)
    return found


def refuse_fitted(tests: Sequence[str], what: Picking) -> None:
    """Refuse a test record that is fitted too."""
    fitted = {file.resolve() for file in what.files}
    for name in tests:
        if Path(name).resolve() in fitted:
            raise InputError("--test", printable(name, 300), "a record that is not fitted")


def driven(fit: DriveFit | PreslidingFit, run: Run, file: str) -> Trial:
    """A free simulation of an axis over a test record, from its measured start."""
    from macromicro.identify.axis_fit import start

    x, v = start(run, fit.gain, fit.delay)
    return Trial(file, run.t, run.x, fit.simulate(run.u, run.dt, x, v))


def lines(trials: Sequence[Trial], unit: str) -> list[Line]:
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
    """Free simulations over fitted records beside those over test records."""
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
