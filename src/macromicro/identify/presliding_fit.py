"""Output error for an axis with elastic friction that depends on the place: `presliding_drive`.

From the axis whose friction is rigid (`drive`): first the elastic friction at one level, then with a
Stribeck drop, then levels at more and more nodes, each begun where the one before it ended. What is
taken is judged by pieces of the records that it was not fitted to, as `axis_choice` judges.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import axis_choice, axis_spread, axis_thin
from macromicro.identify.axis import late
from macromicro.identify.axis_fit import Filtering, drive, rows_of, runs_of
from macromicro.identify.axis_inverse import Estimate, Rows, force_residuals
from macromicro.identify.axis_pieces import Pieces, cut, runs, settled
from macromicro.identify.axis_refine import begun, piece
from macromicro.identify.notices import ConvergenceWarning, DataWarning, notice
from macromicro.identify.presliding import FRICTIONS, REACHES, Presliding, simulate

RIGID = "rigid"
_ASKED = "elastic friction"
_ELASTIC = ("stiffness", "settling", "share")
NODES = (1, 3, 5, 9, 17)  # tried along the travel
_STIFFEST = 2.0 * math.pi  # of the stuck mass' circular frequency times the sample time
_BEGINS = (0.05, 0.3, 1.5, 4.0)  # of the same: where searches begin
_PIECES, _LEAST = 12, 400  # pieces of all records that judge; samples in one
_SMALL = 0.01  # of the mean square of a typical piece: what less is, is no better
_MOST = 60_000  # samples; of longer records evenly spread parts are fitted
_SLOPE, _FINE = 2e-3, 0.1  # of a parameter's scale: for slopes; of that in the last search
_WIDE = 4.0  # of the logarithm of shares
_FLOOR = 1e-3  # of the first level: the least that is allowed


class _Shape(NamedTuple):
    """Which parameters there are."""

    friction: str
    names: tuple[str, ...]  # of the scalars
    nodes: int


@dataclass(frozen=True)
class PreslidingFit:
    """What `presliding_drive` found; x is the unit of position, and force is `gain` times u.

    Attributes
    ----------
    friction : str
        "lugre" or "gms".
    model : Presliding
        The axis.
    names : tuple[str, ...]
        Its parameters, one by one: scalars, then `share k` and `level k`.
    values : ndarray, shape (p,)
        Of these.
    std : ndarray, shape (p,)
        Standard errors; NaN for what the record does not show.
    judged : dict[str, float]
        RMS of free runs over held-out pieces of a typical piece, by what was tried.
    reasons : dict[str, str]
        Why each one but the last was not taken.
    taken : str
        Key of what was taken.
    rms : float
        Of the free run over all records, unit of x.
    free_run : tuple[Array, ...]
        Positions of the axis over each whole record, from its measured start.
    residuals : tuple[Array, ...]
        Measured position less free run.
    gain : float
        Force per unit of u.
    delay : int
        Samples by which u acts late.
    """

    friction: str
    model: Presliding
    names: tuple[str, ...]
    values: Array
    std: Array
    judged: dict[str, float]
    reasons: dict[str, str]
    taken: str
    rms: float
    free_run: tuple[Array, ...]
    residuals: tuple[Array, ...]
    gain: float
    delay: int

    def simulate(self, u: npt.ArrayLike, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
        """Free run of the axis.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input; `gain` and `delay` are applied.
        dt : float
            Sample time, s.
        x : float, optional
            Position at the start.
        v : float, optional
            Speed at the start, per second.

        Returns
        -------
        ndarray, shape (n,)
            Positions.
        """
        push = late(np.asarray(u, np.float64), self.delay) * self.gain
        return simulate(self.model, push, dt, x, v)


class _Problem(NamedTuple):
    """What a search is about: pieces of records, and the scales of the parameters."""

    pieces: list[Pieces]
    rigid: Estimate
    dt: float
    low: float
    high: float

    @property
    def coulomb(self) -> float:
        """Level that others are told in."""
        return max(self.rigid.axis.coulomb + self.rigid.axis.stribeck, 1e-12)

    def model(self, z: Array, shape: _Shape) -> Presliding:
        """The axis that scaled parameters stand for."""
        own = dict(zip(shape.names, z.tolist(), strict=False))
        a = self.rigid.axis
        levels, shares = _parts(z, shape)
        mass = a.mass * own["mass"]
        speed = a.stribeck_speed if "stribeck_speed" in self.rigid.names else self.fastest() / 20.0
        return Presliding(
            mass=mass,
            viscous=a.viscous * own["viscous"],
            offset=self.coulomb * own["offset"],
            asymmetry=a.viscous * own.get("asymmetry", 0.0),
            stribeck=self.coulomb * own.get("stribeck", 0.0),
            stribeck_speed=speed * math.exp(own.get("stribeck_speed", 0.0)),
            stiffness=mass * (math.exp(own["stiffness"]) / self.dt) ** 2,
            settling=own["settling"] * self.dt,
            shares=shares,
            levels=levels * self.coulomb,
            low=self.low,
            high=self.high,
        )

    def fastest(self) -> float:
        """Greatest measured speed."""
        return max(float(np.abs(p.rows.v).max()) for p in self.pieces)

    def missed(self, z: Array, shape: _Shape) -> list[Array]:
        """Measured less free run, of each record."""
        model = self.model(z, shape)
        return [settled(p, model).error for p in self.pieces]


def _parts(z: Array, shape: _Shape) -> tuple[Array, Array]:
    """Levels by the scale, and shares of the elements."""
    count = len(shape.names)
    levels = np.ascontiguousarray(z[count : count + shape.nodes])
    if shape.friction == "lugre":
        return levels, np.empty(0)
    odds = np.exp(np.concatenate([[0.0], z[count + shape.nodes :]]))
    return levels, odds / odds.sum()


def presliding_drive(  # noqa: PLR0913 -- as `drive`, and two more
    t: npt.ArrayLike | Sequence[npt.ArrayLike],
    u: npt.ArrayLike | Sequence[npt.ArrayLike],
    x: npt.ArrayLike | Sequence[npt.ArrayLike],
    *,
    friction: str = "lugre",
    along: int | None = None,
    gain: float = 1.0,
    limit: float | None = None,
    delay: int = 0,
) -> PreslidingFit:
    """Parameters of an axis with LuGre or Maxwell-slip friction (`macromicro.identify.presliding`).

    The measured position must be fine enough to show how the axis gives before it slides.

    Parameters
    ----------
    t : array_like or sequence of array_like
        Times, s, one array per record. So for `u` and `x`.
    u : array_like or sequence of array_like
        Drive voltage, or force with gain 1.
    x : array_like or sequence of array_like
        Position.
    friction : str, optional
        "lugre" or "gms".
    along : int | None, optional
        Nodes of the Coulomb level along the travel; None: as pieces held out ask for.
    gain : float, optional
        Force per unit of u.
    limit : float | None, optional
        The drive saturates there.
    delay : int, optional
        Samples by which u acts late.

    Returns
    -------
    PreslidingFit
        Parameters with standard errors, and what was tried.

    Raises
    ------
    InputError
        An option is not accepted, or the data are unusable.
    """
    if friction not in FRICTIONS:
        raise InputError("structure", friction, ", ".join(FRICTIONS))
    if along is not None and not 1 <= along <= NODES[-1]:
        raise InputError("along", along, f"nodes along the travel, 1 to {NODES[-1]}")
    rigid = drive(t, u, x, gain=gain, limit=limit, delay=delay)
    records = runs_of(t, u, x)
    fitted = records
    if sum(len(r.t) for r in records) > _MOST:
        fitted = axis_thin.stretches(records, _MOST // 5000, 5000)
    rows = rows_of(fitted, gain, Filtering(), limit, delay, 0.3)
    problem = _problem(rows, rigid.refined)
    z, shape, judged, reasons = _chosen(problem, friction, along)
    asked = _asked_for(friction, reasons)
    # Chosen by short pieces, fitted to those that rigid friction is fitted to.
    problem = problem._replace(pieces=_cut(rows, piece(rows, rigid.inverse, False)))
    found = _searched(problem, z, shape, 60)
    found = _searched(problem, found.x, shape, 60, fine=True)
    if found.status == 0:
        notice(ConvergenceWarning, "elastic friction: not settled; the last values are returned")
    model = problem.model(found.x, shape)
    names, values = _told(model, shape)
    spread = _spread(problem, found.x, shape, rows, rigid.inverse)
    if not asked:
        spread[[n.startswith(_ELASTIC) for n in names]] = np.nan
    free, errors = [], []
    for one in rows_of(records, gain, Filtering(), limit, delay, 0.3):
        free.append(simulate(model, one.force, one.run.dt, *begun(one)))
        errors.append(one.run.x - free[-1])
    rms = float(np.sqrt(np.mean(np.concatenate(errors) ** 2)))
    return PreslidingFit(
        friction,
        model,
        names,
        values,
        spread,
        judged,
        reasons,
        _name(shape),
        rms,
        tuple(free),
        tuple(errors),
        float(gain),
        int(delay),
    )


def _problem(rows: list[Rows], rigid: Estimate) -> _Problem:
    total = sum(len(r.v) for r in rows)
    pieces = _cut(rows, max(total // _PIECES, _LEAST))
    every = [r.run.x for r in rows]
    low, high = min(float(x.min()) for x in every), max(float(x.max()) for x in every)
    return _Problem(pieces, rigid, rows[0].run.dt, low, high)


def _cut(rows: list[Rows], length: int) -> list[Pieces]:
    """Pieces of about that length, which begin where the axis goes fast.

    There friction is at its level; of an axis at rest nobody knows how much of the force it takes.
    """
    made = []
    for p in cut(rows, length, False):
        speed = np.abs(p.rows.v)
        starts = p.starts.copy()
        half = int(p.lengths.min()) // 3
        for k, at in enumerate(p.starts[1:].tolist(), 1):
            starts[k] = at - half + int(np.argmax(speed[at - half : at + half]))
        lengths = np.diff(np.append(starts, len(speed)))
        made.append(p._replace(starts=starts, lengths=lengths))
    return made


def _name(shape: _Shape) -> str:
    parts = [shape.friction]
    if "stribeck" in shape.names:
        parts.append("Stribeck")
    parts.append(f"{shape.nodes} nodes" if shape.nodes > 1 else "one level")
    return ", ".join(parts)


def _first(problem: _Problem, friction: str) -> tuple[Array, _Shape]:
    """One level, from the rigid axis; the best of searches from several stiffnesses."""
    rigid = problem.rigid
    names = ["mass", "viscous", "offset", "stiffness", "settling"]
    values = [1.0, 1.0, rigid.axis.offset / problem.coulomb, 0.0, 2.0]
    if "asymmetry" in rigid.names:
        names.append("asymmetry")
        values.append(rigid.axis.asymmetry / rigid.axis.viscous)
    if "stribeck" in rigid.names:
        names += ["stribeck", "stribeck_speed"]
        values += [rigid.axis.stribeck / problem.coulomb, 0.0]
    level = max(rigid.axis.coulomb / problem.coulomb, _FLOOR)
    elements = [0.0] * (len(REACHES) - 1) if friction == "gms" else []
    shape = _Shape(friction, tuple(names), 1)
    ends = []
    for stuck in _BEGINS:
        z = np.array([*values, level, *elements])
        z[names.index("stiffness")] = math.log(stuck)
        ends.append(_searched(problem, z, shape, 30))
    return min(ends, key=lambda end: end.cost).x, shape


def _searched(
    problem: _Problem,
    z: Array,
    shape: _Shape,
    most: int,
    held: int | None = None,
    fine: bool = False,
) -> Any:
    """Output error from `z`; `held`: a third of the pieces is left out; `fine`: to the end."""
    from scipy.optimize import least_squares

    low, high, scale = _bounds(z, shape)
    kept = _weights(problem, held)
    size = math.sqrt(sum(float(np.sum(w)) for w in kept)) * problem.fastest() * problem.dt

    def missed(at: Array) -> Array:
        errors = problem.missed(at, shape)
        return np.concatenate([e * w for e, w in zip(errors, kept, strict=True)]) / size

    begin = np.clip(z, low + 1e-6, high - 1e-6)
    return least_squares(
        missed,
        begin,
        lambda at: _slopes(missed, at, scale, low, _SLOPE * (_FINE if fine else 1.0)),
        bounds=(low, high),
        x_scale="jac",
        ftol=1e-9 if fine else 1e-6,
        xtol=1e-6,
        max_nfev=most,
    )


def _weights(problem: _Problem, held: int | None) -> list[Array]:
    """1 for samples of pieces that count, 0 for those held out."""
    made, first = [], 0
    for p in problem.pieces:
        number = first + np.arange(len(p.starts))
        kept = np.ones(len(number)) if held is None else (axis_choice.turn(number) != held)
        made.append(np.repeat(np.asarray(kept, np.float64), p.lengths))
        first += len(number)
    return made


def _bounds(z: Array, shape: _Shape) -> tuple[Array, Array, Array]:
    """Least, greatest and scale of each parameter."""
    limits = {
        "mass": (0.05, 20.0, 0.1),
        "viscous": (0.0, 50.0, 0.2),
        "offset": (-5.0, 5.0, 0.1),
        "stiffness": (math.log(1e-4), math.log(_STIFFEST), 2.0),
        "settling": (0.0, 1e4, 2.0),
        "asymmetry": (-20.0, 20.0, 0.1),
        "stribeck": (0.0, 20.0, 0.2),
        "stribeck_speed": (-4.0, 4.0, 0.5),
    }
    rows = [limits[n] for n in shape.names] + [(_FLOOR, 50.0, 0.1)] * shape.nodes
    rows += [(-_WIDE, _WIDE, 1.0)] * (len(z) - len(rows))
    low, high, scale = np.array(rows).T
    return low, high, scale


def _slopes(
    missed: Callable[[Array], Array], at: Array, scale: Array, low: Array, part: float = _SLOPE
) -> Array:
    columns = []
    for k in range(len(at)):
        up, down = at.copy(), at.copy()
        nudge = part * max(scale[k] * 5.0, abs(at[k]))
        up[k] += nudge
        down[k] = max(at[k] - nudge, low[k])
        columns.append((missed(up) - missed(down)) / (up[k] - down[k]))
    return np.stack(columns, axis=1)


def _chosen(
    problem: _Problem, friction: str, along: int | None
) -> tuple[Array, _Shape, dict[str, float], dict[str, str]]:
    """What held-out pieces ask for: the poorest that no richer one beats."""
    z, shape = _first(problem, friction)
    tried = [(z, shape)]
    if "stribeck" not in shape.names:
        at = len(shape.names)
        more = shape._replace(names=(*shape.names, "stribeck", "stribeck_speed"))
        tried.append((_searched(problem, np.insert(z, at, [0.1, 0.0]), more, 20).x, more))
    squares = {RIGID: _rigid(problem)}
    # A piece in which next to nothing moves shall not outweigh the others in a mean of logarithms.
    floor = _SMALL * float(np.median(squares[RIGID]))
    for z, shape in tried:
        squares[_name(shape)] = _held_out(problem, z, shape) + floor
    squares[RIGID] += floor
    best = tried[0]
    reasons: dict[str, str] = {}
    best = _better(best, tried[1:], squares, reasons)
    for nodes in NODES[1:] if along is None else (along,):
        z, shape = best
        if nodes == shape.nodes:
            continue
        finer = shape._replace(nodes=nodes)
        end = _searched(problem, _refined(z, shape, nodes), finer, 20)
        squares[_name(finer)] = _held_out(problem, end.x, finer) + floor
        if along is not None:
            best = (end.x, finer)
            break
        before = best
        best = _better(best, [(end.x, finer)], squares, reasons)
        if best is before and nodes > NODES[1]:
            break
    scores = {n: float(np.exp(0.5 * np.mean(np.log(s)))) for n, s in squares.items()}
    taken = _name(best[1])
    gained = np.log(squares[RIGID] / squares[taken])
    why = axis_choice.no_better(scores[RIGID], scores[taken], gained, RIGID)
    reasons[RIGID if not why else _ASKED] = why or f"{taken} is better"
    return *best, scores, reasons


def _asked_for(friction: str, reasons: dict[str, str]) -> bool:
    """Whether elastic friction is better than rigid friction; says so where it is not."""
    if _ASKED not in reasons:
        return True
    notice(
        DataWarning,
        f"{friction} friction foretells pieces held out no better, within what they differ, than "
        "rigid friction fitted to all of them: the record does not ask for it, and no standard "
        "error is told of what is elastic",
    )
    return False


def _better(best, others, squares: dict[str, Array], reasons: dict[str, str]):  # noqa: ANN001, ANN202
    for other in others:
        poor, rich = squares[_name(best[1])], squares[_name(other[1])]
        scores = [float(np.exp(0.5 * np.mean(np.log(s)))) for s in (poor, rich)]
        why = axis_choice.no_better(*scores, np.log(poor / rich), _name(best[1]))
        if why:
            reasons[_name(other[1])] = why
        else:
            reasons[_name(best[1])] = f"{_name(other[1])} is better"
            best = other
    return best


def _refined(z: Array, shape: _Shape, nodes: int) -> Array:
    """The same levels at more nodes."""
    count = len(shape.names)
    old = z[count : count + shape.nodes]
    at = np.linspace(0.0, 1.0, nodes)
    new = np.interp(at, np.linspace(0.0, 1.0, max(shape.nodes, 2)), np.resize(old, max(len(old), 2)))
    return np.concatenate([z[:count], new, z[count + shape.nodes :]])


def _held_out(problem: _Problem, z: Array, shape: _Shape) -> Array:
    """Mean square of the free run over each piece, by a fit that it had no part in."""
    found = []
    for held in range(axis_choice.FOLDS):
        end = _searched(problem, z, shape, 8, held)
        first = 0
        for p, error in zip(problem.pieces, problem.missed(end.x, shape), strict=True):
            means = np.add.reduceat(error**2, p.starts) / p.lengths
            number = first + np.arange(len(p.starts))
            mine = axis_choice.turn(number) == held
            found += zip(number[mine].tolist(), means[mine].tolist(), strict=True)
            first += len(number)
    return np.array([m for _, m in sorted(found)])


def _rigid(problem: _Problem) -> Array:
    """Mean square of the rigid axis' free run over each piece, fitted to all of them."""
    found = []
    for p in problem.pieces:
        error = settled(p, problem.rigid.axis).error
        found.append(np.add.reduceat(error**2, p.starts) / p.lengths)
    return np.concatenate(found)


def _told(model: Presliding, shape: _Shape) -> tuple[tuple[str, ...], Array]:
    """Parameters one by one, in the user's units."""
    names = [n for n in shape.names]
    values = [float(getattr(model, n)) for n in names]
    for k, share in enumerate(model.shares, 1):
        names.append(f"share {k}")
        values.append(float(share))
    names += [f"level {k}" for k in range(1, shape.nodes + 1)]
    values += [float(v) for v in model.levels]
    return tuple(names), np.array(values)


def _spread(
    problem: _Problem, z: Array, shape: _Shape, rows: list[Rows], inverse: Estimate
) -> Array:
    """Standard errors; NaN where a parameter ended at its bound."""
    low, high, scale = _bounds(z, shape)
    model = problem.model(z, shape)

    def missed(at: Array) -> Array:
        return np.concatenate(problem.missed(at, shape))

    slopes = _slopes(missed, z, scale, low)
    noise = axis_spread.noise(rows, force_residuals(rows, inverse), inverse.axis)
    covariance, _ = axis_spread.covariance(problem.pieces, model, slopes, missed(z), noise)

    def told(at: Array) -> Array:
        return _told(problem.model(at, shape), shape)[1]

    turn = _slopes(told, z, scale, low)
    std = np.sqrt(np.diag(turn @ covariance @ turn.T))
    ended = (z <= low + 1e-3 * scale) | (z >= high - 1e-3 * scale)
    names = _told(model, shape)[0]
    bound = [n for n, at in zip(shape.names, ended, strict=False) if at]
    if bound:
        notice(
            DataWarning,
            f"elastic friction: {', '.join(bound)} at the end of what is allowed: the record does "
            "not show how much there is, and no standard error is told for it",
        )
    std[[names.index(n) for n in bound]] = np.nan
    return np.asarray(std)
