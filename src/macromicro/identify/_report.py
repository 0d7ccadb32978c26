"""The report of every kind: validation records, figures of the fit, notes of parameters."""

# A kind gives a `Result` with what only it has, and a measured and simulated curve for each record;
# `completed` adds what all kinds have.

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.picking import Picked, Picking, Role, alike, load, there
from macromicro.identify.records import fit_percent
from macromicro.identify.result import Line, Result
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TEST = "test"  # name of the line of a validation record
_SHOWN = 3  # records in a figure


class Pair(NamedTuple):
    file: str  # "" for a fitted record
    t: Array  # time, or what the curves are drawn over
    measured: Array  # the output
    model: Array  # the output by the model, from the input alone

    @property
    def rms(self) -> float:
        if not len(self.t):
            return math.nan
        return float(np.sqrt(np.mean((self.measured - self.model) ** 2)))

    @property
    def percent(self) -> float:
        """Fit in percent; 100 is perfect, NaN for a constant output."""
        return fit_percent([self.measured], [self.model])


class Curves(NamedTuple):
    """The fitted records, as the figures show them."""

    pairs: Sequence[Pair]
    label: str  # of the output, with its unit
    dt: float  # sample time, s
    residuals: Sequence[Array] | None = None  # per record; None: measured less model
    residual_label: str | None = None  # None: as the output


def pairs(t: Iterable[Array], measured: Iterable[Array], model: Iterable[Array]) -> list[Pair]:
    return [Pair("", *each) for each in zip(t, measured, model, strict=True)]


def complete(
    result: Result,
    unit: str = "",
    tests: Sequence[Pair] = (),
    curves: Callable[[], Curves] | None = None,
) -> Result:
    """A kind's result with its validation records and the figures of free run and residuals."""
    own = result.draw

    def draw() -> dict[str, Figure]:
        from macromicro.identify.kinds import pictures

        if curves is None:
            return own()
        seen = curves()
        left = [p.measured - p.model for p in seen.pairs]
        residuals = left if seen.residuals is None else seen.residuals
        label = seen.label if seen.residual_label is None else seen.residual_label
        return {
            "free_run": free_run(seen.pairs, tests, seen.label),
            "residuals": pictures.leftover(residuals, seen.dt, label),
            **own(),
        }

    result.lines += validation_lines(tests, unit)
    result.data.setdefault("tests", validation_data(tests))
    result.draw = draw
    return result


def records(
    picking: Picking, roles: Sequence[Role], tests: Sequence[str]
) -> tuple[list[Picked], list[Picked]]:
    """Columns of the records to fit and of the validation records, in the same units."""
    tables = load(picking, roles)
    return tables, unseen(tests, picking, roles, tables[0])


def unseen(
    tests: Sequence[str], what: Picking, roles: Sequence[Role], first: Picked
) -> list[Picked]:
    """Columns of validation records, in the units of the fitted ones."""
    if not tests:
        return []
    refuse_fitted(tests, what)
    found = load(Picking(there(list(tests)), what.columns), roles)
    for table in found:
        alike(table, first.units, first.file)
    return found


def refuse_fitted(tests: Sequence[str], what: Picking) -> None:
    """Refuse a validation record that is fitted too."""
    fitted = {file.resolve() for file in what.files}
    for name in tests:
        if Path(name).resolve() in fitted:
            raise InputError("--test", printable(name, 300), "a record that is not fitted")


def validation_lines(tests: Sequence[Pair], unit: str) -> list[Line]:
    return [
        Line(
            validation_name(k, len(tests)),
            one.percent,
            unit="%",
            note=f"free run, not fitted: RMS {one.rms:.3g} {unit} over {len(one.t)} samples of "
            f"{printable(Path(one.file).name)}",
        )
        for k, one in enumerate(tests, 1)
    ]


def validation_name(number: int, count: int) -> str:
    return f"{TEST} {number}" if count > 1 else TEST


def validation_data(tests: Sequence[Pair]) -> list[dict[str, Any]]:
    return [
        {"file": one.file, "fit_percent": one.percent, "rms": one.rms, "samples": len(one.t)}
        for one in tests
    ]


def of_range(test: Pair, extent: float, how: str = "") -> tuple[str, str]:
    """A remark on a prediction, in percent of the fitted output's range."""
    text = f"RMS {100.0 * test.rms / extent:.2f} % of range, over {len(test.t)} samples"
    return f"prediction of {test.file}", ", ".join(filter(None, (text, how)))


def warn_of_undetermined(lines: Sequence[Line], names: Iterable[str]) -> None:
    """Warn of parameters that cannot be 0 and whose standard error exceeds their value."""
    wanted = set(names)
    lost = [line.name for line in lines if line.name in wanted and line.error > abs(line.value)]
    if lost:
        text = "not determined by the records: the standard error exceeds the value"
        notice(DataWarning, f"{', '.join(lost)}: {text}")


def free_run(fitted: Sequence[Pair], tests: Sequence[Pair], label: str) -> Figure:
    """Free simulations of fitted records beside those of validation records."""
    from macromicro.identify.kinds import pictures

    shown, names = list(fitted), []
    if tests:
        others = list(tests[: _SHOWN - 1])
        shown = shown[: _SHOWN - len(others)]
        names = [
            f"fitted, {k} of {len(fitted)}" if len(fitted) > 1 else "fitted"
            for k in range(1, len(shown) + 1)
        ]
        names += [f"not fitted: {printable(Path(one.file).name, 30)}" for one in others]
        shown += others
    return pictures.free_runs(shown, label, names)


def notes(lines: Sequence[Line], point: str = "_") -> dict[str, tuple[float, str]]:
    """Parameters for a plain model.toml: value and unit with its error by the line's name."""
    found = {}
    for line in lines:
        if line.name.split()[0] == TEST:
            continue
        error = "" if math.isnan(line.error) else f"+- {line.error:.2g}"
        extra = "" if math.isnan(line.extra) else f"{line.extra_name} {line.extra:.2g}"
        key = line.name.replace(", ", "_").replace(" %", "").replace(" ", "_").replace(".", point)
        found[key] = float(line.value), ", ".join(filter(None, (line.unit, error, extra)))
    return found
