"""Physical parameters of a motor-driven axis from a recording: `drive`."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify import (
    _axis_choice,
    _axis_delay,
    _axis_doubts,
    _axis_drive,
    _axis_load,
    _axis_thin,
)
from macromicro.identify._axis_choice import part
from macromicro.identify._axis_instruments import instrumented, redrawn
from macromicro.identify._axis_refine import begun, free_runs, refined, started
from macromicro.identify._choose import Judged
from macromicro.identify.axis import Axis, late, simulate
from macromicro.identify.axis_inverse import (
    STRUCTURES,
    Estimate,
    Rows,
    differences,
    fitted,
    plausible,
)
from macromicro.identify.driven import FIT, USUAL, Driven, Filtering
from macromicro.identify.notices import DataWarning, notice
from macromicro.identify.records import flag_saturation
from macromicro.identify.runs import Run, checked

_LEAST = 200
_SHARE = 0.05  # of the time: an axis that goes back for less shows no friction in that direction
_MANY = 3  # with so many records, whole ones are held out


CUTOFF = _axis_thin.CORNER  # of positions, in the samples' rate, where none is asked for


@dataclass(frozen=True)
class DriveFit:
    """What `drive` found; x is the unit of position, and force is `gain` times u."""

    structure: str  #: the chosen one of "viscous", "coulomb", "asymmetric", "stribeck", "full"
    inverse: Estimate  #: the estimate by inverse dynamics
    refined: Estimate  #: the estimate by output error
    #: RMS force error of each structure tried on data that it was not fitted to, in a typical block
    #: (`axis_choice`); empty when one was asked for
    holdout: dict[str, float]
    #: position RMS of the free run over the last part of each record (of three or more: over every
    #: third one) by the output-error fit to the rest
    holdout_rms: float
    #: position and speed at the start of each record, as its free run asks for
    starts: tuple[tuple[float, float], ...]
    #: positions of the refined axis over each whole record, from `starts`
    free_run: tuple[Array, ...]
    residuals: tuple[Array, ...]  #: measured position less free run, an array per record
    gain: float  #: force per unit of u
    delay: int  #: samples by which u acts late
    #: why each other structure was not chosen, in words
    reasons: dict[str, str] = field(default_factory=dict)
    limit: float | None = None  #: u saturates there

    @property
    def rms(self) -> float:
        """RMS error of the free run over all records, in the unit of x."""
        return self.refined.rms

    @property
    def fit(self) -> float:
        """Free-run fit in percent; 100 is perfect."""
        return 100.0 - self.refined.percent

    @property
    def axis(self) -> Axis:
        """The refined parameters."""
        return self.refined.axis

    def simulate(self, u: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        """Free run of the refined axis.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input; `limit`, `gain` and `delay` are applied.
        dt : float
            Sample time, s.
        x : float, optional
            Position at the start, unit of position.
        v : float, optional
            Speed at the start, unit of position per s.

        Returns
        -------
        ndarray, shape (n,)
            Positions.
        """
        driven = Driven(self.gain, self.limit, self.delay)
        return simulate(self.axis, driven.force(np.asarray(u, np.float64)), dt, x, v)


def drive(  # noqa: PLR0913 -- one parameter per option
    t: Any,
    u: Any,
    x: Any,
    *,
    gain: float = 1.0,
    structure: str = "auto",
    filtering: Filtering = USUAL,
    holdout: float = 0.3,
    limit: float | None = None,
    delay: int | str = 0,
    eccentric: bool | None = False,
) -> DriveFit:
    """Parameters of M dv/dt = gain u - friction(v) - offset (`macromicro.identify.axis`).

    First inverse dynamics: linear regression of the force on filtered differences of the position
    (A. Janot, M. Gautier, M. Brunot, EMPS benchmark, 2019). Then output error: the parameters whose
    free simulation is nearest to x. Warns (`DataWarning`) of doubtful data.

    Parameters
    ----------
    t, u, x : array_like
        Times, s, drive voltage (or force with gain 1), and position: arrays of shape (n,), or lists
        of such arrays, one per record.
    gain : float, optional
        Force per unit of u, N/V; with gain 1 the parameters are in units of u (V s2/count, V
        s/count, V).
    structure : str, optional
        Friction, or "auto": each structure is fitted to two thirds of the blocks of the records and
        judged by the others, in turn; a richer one is chosen only if it predicts their force at
        least 2 % better, and by more than the blocks scatter (`axis_choice`).
    filtering : Filtering, optional
        Filter of the position and decimation.
    holdout : float, optional
        Last part of each record for judging the output error (of three records or more: every third
        record).
    limit : float | None, optional
        Saturation of the drive: u is clipped to +-limit, with a warning.
    delay : int | str, optional
        Delay of u in samples; "fit": identified, with the fraction of a sample as the axis' `lag`.
    eccentric : bool | None, optional
        Eccentric load, x in rad: `sine` and `cosine` of the axis are identified, too. None: x in
        rad without such a load, with a warning if one shows.

    Returns
    -------
    DriveFit
        Parameters by both methods, with standard errors.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import Axis, drive, simulate
    >>> t = 2e-3 * np.arange(600)
    >>> u = 2.0 * np.sign(np.sin(2.0 * np.pi * 1.7 * t)) + np.sin(2.0 * np.pi * 0.6 * t)  # V
    >>> x = simulate(Axis(mass=1.2, viscous=14.0, coulomb=3.0), 4.0 * u, dt=2e-3)  # m
    >>> found = drive(t, u, x, gain=4.0, structure="coulomb")  # 4 N/V
    >>> found.refined.values[:3].round(2)  # kg, N s/m, N
    array([ 1.2, 14. ,  3. ])
    """
    _check(gain, structure, holdout, delay)
    runs = runs_of(t, u, x)
    whole = 0 if isinstance(delay, str) else int(delay)
    driven = Driven(gain, limit, whole, bool(eccentric), filtering, holdout)
    lag: tuple[float, float] | None = None  # s, beyond whole samples, and its standard error
    if isinstance(delay, str):
        driven, lag = _delayed(runs, driven)
    fine, coarse = 1, 1
    if filtering == USUAL and lag is None:
        fine, coarse = _axis_thin.factors(runs, driven)
    few = _few(runs, coarse)
    rows = rows_of(few, driven)
    if lag is None:
        _axis_drive.warned(rows, gain)
    judged = Judged(structure, {}, {})
    if structure == "auto":
        judged = _axis_choice.chosen(rows if lag is None else _axis_delay.pushed(rows, lag[0]))
        structure = judged.structure
    if eccentric is None:
        _axis_load.warned(rows, structure)
    if coarse > 1:
        rows = _means(runs, fine, driven)
    inverse = _unblurred(runs, _inverse(rows, structure, lag), driven, structure, fine)
    _axis_doubts.against(inverse)
    if not plausible(inverse):
        notice(
            DataWarning,
            f"inverse dynamics gives a negative mass or friction: {inverse}; "
            "output error keeps them above zero",
        )
    seen = rows
    if coarse > 1:
        rows = seen = _means(runs, coarse, driven)  # the longer ones are in memory no more
    judging = seen if lag is None else _axis_delay.pushed(seen, lag[0])
    test, trained = _judged(judging, holdout, structure)
    missed = np.concatenate(free_runs(test, trained.axis, started(test, trained.axis))[1])
    final = refined(seen, inverse) if lag is None else _axis_delay.refined_late(seen, inverse, *lag)
    if lag is not None and final.axis.lag != lag[0]:
        inverse = _inverse(rows, structure, (final.axis.lag, float(final.std[-1])))
    _axis_doubts.mixed(inverse, rows)
    _axis_doubts.coarse((inverse, final), runs[0].dt)
    starts = started(seen, final.axis)
    if coarse > 1:
        final, free, errors = _axis_thin.whole(runs, final, starts, driven, coarse)
    else:
        free, errors = free_runs(seen, final.axis, starts)
    if final.sensed and coarse == 1 and lag is None:
        inverse = redrawn(rows, inverse, final.axis, free)
    return DriveFit(
        structure,
        inverse,
        final,
        judged.scores,
        float(np.sqrt(np.mean(missed**2))),
        tuple(starts),
        tuple(free),
        tuple(errors),
        float(gain),
        driven.delay,
        judged.reasons,
        limit,
    )


def _check(gain: float, structure: str, holdout: float, delay: int | str) -> None:
    if not (np.isfinite(gain) and gain != 0.0):
        raise InputError("gain", gain, "a finite number other than zero")
    if structure != "auto" and structure not in STRUCTURES:
        raise InputError("structure", structure, ", ".join(["auto", *STRUCTURES]))
    if not 0.05 <= holdout <= 0.7:
        raise InputError("holdout", holdout, "a part from 0.05 to 0.7")
    whole = isinstance(delay, int | np.integer) and 0 <= int(delay) <= _axis_delay.LATEST
    if delay != FIT and not whole:
        raise InputError(
            "delay", delay, f'a whole number of samples from 0 to {_axis_delay.LATEST}, or "{FIT}"'
        )


def runs_of(t: Any, u: Any, x: Any) -> list[Run]:
    for name, values in (("t", t), ("u", u), ("x", x)):
        if not hasattr(values, "__len__") or len(values) == 0:
            raise ProblemError(
                f"drive: {name}", "the array is missing or empty", "Give an array of numbers."
            )
    if np.ndim(next(iter(t))) == 0:
        return [checked(t, u, x, "record", _LEAST)]
    if not len(t) == len(u) == len(x):
        found = f"t, u and x hold {len(t)}, {len(u)} and {len(x)} arrays"
        raise ProblemError("records", found, "Give as many of each.")
    return [
        checked(*one, f"record[{i}]", _LEAST) for i, one in enumerate(zip(t, u, x, strict=True))
    ]


def rows_of(runs: list[Run], driven: Driven) -> list[Rows]:
    if all(np.ptp(r.u) == 0.0 and r.u[0] == runs[0].u[0] for r in runs):
        raise ProblemError(
            "u", f"the input is constant at {runs[0].u[0]:g}", "Record an input that changes."
        )
    # The part held out must be longer than the low-pass of the decimation, 21 factors.
    filtering = driven.filtering
    shortest = min(len(r.u) for r in runs) * (1.0 if len(runs) >= _MANY else driven.holdout)
    most = int(shortest) // 30
    factor = min(10, most) if filtering.decimate is None else filtering.decimate
    if not isinstance(factor, int | np.integer) or not 1 <= factor <= most:
        raise InputError("decimate", factor, f"a whole number from 1 to {most}")
    rows = []
    for i, run in enumerate(runs):
        if np.ptp(run.x) == 0.0:
            raise ProblemError(
                f"record[{i}].x", f"the position is constant at {run.x[0]:g}", "Record a motion."
            )
        _axis_doubts.jumps(run, f"record[{i}].x")
        corner = CUTOFF / run.dt if filtering.cutoff is None else filtering.cutoff
        if not 0.0 < corner < 0.5 / run.dt:
            raise InputError("cutoff", corner, f"between 0 and {0.5 / run.dt:g} Hz")
        push = driven.force(flag_saturation(run.u, f"record[{i}].u", driven.limit))
        rows.append(differences(run, push, corner, int(factor), eccentric=driven.eccentric))
    return rows


def start(run: Run, gain: float, delay: int) -> tuple[float, float]:
    return begun(differences(run, late(run.u, delay) * gain, CUTOFF / run.dt, 1))


def _few(runs: list[Run], coarse: int) -> list[Run]:
    """Records for the choice of friction: all, or evenly spread parts of long ones."""
    if coarse == 1:
        return runs
    for k, run in enumerate(runs):
        _axis_doubts.jumps(run, f"record[{k}].x")
    return _axis_thin.stretches(runs)


def _means(runs: list[Run], many: int, driven: Driven) -> list[Rows]:
    made = _axis_thin.thinned(runs, many, driven)
    cut = Filtering(*_axis_thin.filtering(many, made[0].dt))
    rows = rows_of(made, driven._replace(filtering=cut, delay=0))
    return [r._replace(thin=many) for r in rows]


def _split(rows: list[Rows], holdout: float) -> tuple[list[Rows], list[Rows]]:
    """Records to fit and records to judge by: tails, or every third of three or more."""
    if len(rows) >= _MANY:
        return [r for i, r in enumerate(rows) if i % _MANY != _MANY - 1], rows[_MANY - 1 :: _MANY]
    cuts = [round(len(r.v) * (1.0 - holdout)) for r in rows]
    return (
        [part(r, slice(0, cut)) for r, cut in zip(rows, cuts, strict=True)],
        [part(r, slice(cut, None)) for r, cut in zip(rows, cuts, strict=True)],
    )


def _inverse(rows: list[Rows], structure: str, lag: tuple[float, float] | None) -> Estimate:
    """Inverse dynamics, with the error of a delay that was found."""

    def made(rows: list[Rows]) -> Estimate:
        rows = _axis_thin.pieces(rows)
        return instrumented(rows, fitted(rows, structure))

    return made(rows) if lag is None else _axis_delay.under(made, rows, *lag)


def _unblurred(
    runs: list[Run], found: Estimate, driven: Driven, structure: str, fine: int
) -> Estimate:
    """Inverse dynamics of means over `fine` samples, less their bias at reversals."""

    def again(parts: list[Run]) -> Estimate:
        return _inverse(_means(parts, fine, driven), structure, None)

    blurred = fine > 1 and plausible(found)
    return _axis_thin.unblurred(runs, found, driven, again) if blurred else found


def _judged(rows: list[Rows], holdout: float, structure: str) -> tuple[list[Rows], Estimate]:
    """Records to judge by and the fit to the rest; every third block if `_split` falls short."""
    train, test = _split(rows, holdout)
    shown = _axis_doubts.directions(train, _SHARE)
    start = _seen(train, structure) if _axis_doubts.directions(test, _SHARE) <= shown else None
    if start is None:
        train, test = next(_axis_choice.folds(rows))
        start = fitted(train, structure, told=False)
    return test, refined(train, start, told=False)


def _seen(rows: list[Rows], structure: str) -> Estimate | None:
    try:
        return fitted(rows, structure, told=False)
    except InputError:
        return None


def _delayed(runs: list[Run], driven: Driven) -> tuple[Driven, tuple[float, float]]:
    """The drive with whole samples of delay, and the remaining delay with its standard error, s."""
    rows = rows_of(runs, driven)
    found, error = _axis_delay.exact(rows, _axis_delay.delay(rows))
    whole, dt = max(int(found) - 1, 0), runs[0].dt
    return driven._replace(delay=whole), ((found - whole) * dt, error * dt)
