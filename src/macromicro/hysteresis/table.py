"""The table of first-order curves (Section 2.4.1, Figures 2.19 and 5.8) in the user's units."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.curves import KINDS, ClockwiseWarning, ClosureWarning, Curve, Kind, tidy
from macromicro.hysteresis.everett import Everett
from macromicro.hysteresis.shape import (
    ROUNDS,
    Grid,
    along_output,
    branches,
    cells,
    fit_everett,
    number_nodes,
    readings,
)

Shape = Literal["free", "monotone", "nonnegative"]
SHAPES = ("free", "monotone", "nonnegative")
Between = Literal["input", "output"]
BETWEENS = ("input", "output")
NODES = 151
MOST_NODES = 801


class Misfit(NamedTuple):
    """How far a table is from curves.

    Examples
    --------
    >>> from macromicro.hysteresis import FodTable
    >>> curves = [([10.0, 5.0, 0.0], [8.0, 6.0, 0.0]), ([5.0, 2.5, 0.0], [3.0, 2.0, 0.0])]  # V, um
    >>> found = FodTable.from_curves(curves, nodes=21).misfit()
    >>> found.points, round(found.largest, 6)
    (6, 0.0)
    """

    rms: float  #: unit of the output
    largest: float  #: unit of the output
    points: int  #: number compared


@dataclass(frozen=True, eq=False)
class FodTable:
    """E on a uniform grid, in the unit of the output, for the Preisach model.

    ``values[i, j]`` is ``E(u_i, u_j) = f_M - f_{M,m}`` for M = u_i, m = u_j (2.8), with ``u_i = lo
    + i * step``; cells as in `Everett`.

    Examples
    --------
    >>> from macromicro.hysteresis import FodTable, Preisach
    >>> outer = [10.0, 5.0, 0.0], [8.0, 6.0, 0.0]  # V and um, from the reversal on
    >>> inner = [5.0, 2.5, 0.0], [3.0, 2.0, 0.0]
    >>> table = FodTable.from_curves([outer, inner], nodes=21)
    >>> Preisach(table).run([5.0, 10.0, 5.0]).round(3).tolist()  # um
    [3.0, 8.0, 6.0]
    """

    lo: float  #: lowest input of the grid
    step: float  #: from grid line to grid line, unit of the input
    values: Array  #: unit of the output; 0 for i <= j
    f_low: float  #: output in negative saturation
    kind: Kind = "descending"  #: source curves
    #: the curves that it was made from as they came, pairs of shape (m,)
    raw: tuple[tuple[Array, Array], ...] = field(default=(), repr=False)
    shape: Shape = "free"  #: the law that it obeys, as for `from_curves`
    smooth: float = 0.0  #: as for `from_curves`, grid steps
    between: Between = "input"  #: as for `from_curves`
    input_unit: str = ""  #: "" if unknown
    output_unit: str = ""  #: "" if unknown

    def __post_init__(self) -> None:
        n = math.isqrt(self.values.size)
        if n < 2 or self.values.shape != (n, n) or not np.isfinite(self.values).all():
            raise InputError("table, values", self.values.shape, "finite numbers, shape (n, n)")
        if np.any(np.triu(self.values) != 0.0):
            problem = "the values on or above the diagonal are not 0"
            raise ProblemError("table, values", problem, "Set them to 0.")
        if not (math.isfinite(self.lo) and math.isfinite(self.step) and self.step > 0.0):
            raise InputError("table, grid", (self.lo, self.step), "a finite lo, a step above 0")
        if not math.isfinite(self.f_low) or self.span == 0.0:
            raise InputError("table, output", (self.f_low, self.span), "two different saturations")
        _check_words(self.kind, self.shape, self.between)

    @classmethod
    def from_curves(
        cls,
        curves: Iterable[tuple[npt.ArrayLike, npt.ArrayLike]],
        kind: Kind = "descending",
        *,
        shape: Shape = "free",
        smooth: float = 1.0,
        between: Between = "input",
        nodes: int = NODES,
        limits: tuple[float, float] | None = None,
        rounds: int = ROUNDS,
    ) -> Self:
        """The table that fits measured first-order curves in the least-squares sense.

        Below (ascending: above) the outermost reversal the model has no hysteresis. Warns with a
        `curves.CurveWarning`; `curves.tidy` says what is mended with a warning and what is refused.

        Parameters
        ----------
        curves : Iterable[tuple[npt.ArrayLike, npt.ArrayLike]]
            Pairs of input and output, shape (m,) each, from the reversal on.
        kind : Kind, optional
            "descending" curves start on the rising branch, "ascending" ones on the falling branch.
        shape : Shape, optional
            "free", "monotone" (branches never turn back) or "nonnegative" (relay density of at
            least 0); a loop that falls with the input counts with the sign reversed.
        smooth : float, optional
            Length in grid steps below which structure of the density is taken for noise; it leaves
            the major loop as it is.
        between : Between, optional
            How the table goes on between two curves: smoothly over the "input", or along the
            "output", where branches are steep.
        nodes : int, optional
            Grid points per axis.
        limits : tuple[float, float] | None, optional
            Inputs of negative and positive saturation, where the data do not show them; by default
            the extremes of the data.
        rounds : int, optional
            Of the iteration that meets a shape, at most; 200 do to compare tables.

        Returns
        -------
        Self
            In the units of the curves, which it keeps as `raw`.

        Raises
        ------
        InputError
            The curves or an option are not accepted.
        ProblemError
            Both ends have the same output.
        """
        listed = list(curves)
        _check_words(kind, shape, between)
        if not 0.0 <= smooth <= 100.0:
            raise InputError("table, smooth", smooth, "a length of 0 to 100 grid steps")
        if not 8 <= nodes <= MOST_NODES:
            raise InputError("table, nodes", nodes, f"8 to {MOST_NODES} grid points per axis")
        used = tidy(listed, kind)
        raw = tuple((np.array(u), np.array(f)) for u, f in listed)
        sign = 1.0 if kind == "descending" else -1.0
        turn = 1.0 if sum(curve.f[0] - curve.f[-1] for curve in used) >= 0.0 else -1.0
        used = [Curve(curve.u, turn * curve.f) for curve in used]
        grid = _grid(used, sign, nodes, limits)
        rising, falling, gap = branches(used, grid, shape != "free")
        low, span = float(rising[0]), float(rising[-1] - rising[0])
        extent = float(np.ptp(np.concatenate([curve.f for curve in used])))
        if span < 1e-3 * extent:
            remedy = "Record curves between two different saturations."
            raise ProblemError("first-order curves", "the output is equal at both ends", remedy)
        if abs(gap) > 0.02 * extent:
            share = 100.0 * abs(gap) / extent
            message = f"branches end {share:.1f} % of the range apart; difference distributed"
            warnings.warn(message, ClosureWarning, stacklevel=2)
        if float(np.sum(falling - rising)) < 0.0:
            message = "the loop runs clockwise. Check the kind"
            warnings.warn(message, ClockwiseWarning, stacklevel=2)
        scaled = [Curve(curve.u, (curve.f - low) / span) for curve in used]
        loop = ((rising - low) / span, (falling - low) / span)
        filled = along_output(scaled, grid.nodes, loop[0]) if between == "output" else []
        values = turn * span * fit_everett(scaled, grid, loop, shape, smooth, filled, rounds)
        lo, f_low = grid.lo, turn * low
        if sign < 0.0:
            lo, f_low = -(grid.lo + (nodes - 1) * grid.step), -turn * (low + span)
            values = values[::-1, ::-1].T
        return cls(
            lo, grid.step, np.ascontiguousarray(values), f_low, kind, raw, shape, smooth, between
        )

    @classmethod
    def from_everett(cls, table: Everett, f_low: float = 0.0, f_high: float = 1.0) -> Self:
        """The table of a given relay density.

        Parameters
        ----------
        table : Everett
            Normalised.
        f_low, f_high : float, optional
            Outputs in negative and positive saturation, unit of the output.

        Returns
        -------
        Self
            In the unit of `f_low` and `f_high`.
        """
        return cls(table.lo, table.step, (f_high - f_low) * table.values, f_low)

    @property
    def n(self) -> int:
        """Grid points per axis."""
        return int(self.values.shape[0])

    @property
    def hi(self) -> float:
        """Input of positive saturation, the last grid line."""
        return self.lo + (self.n - 1) * self.step

    @property
    def grid(self) -> Array:
        """Inputs of the grid lines, shape (n,)."""
        return self.lo + self.step * np.arange(self.n, dtype=np.float64)

    @property
    def span(self) -> float:
        """Output in positive less that in negative saturation; below 0 for a falling loop."""
        return float(self.values[-1, 0])

    @property
    def first_order(self) -> Array:
        """f_{M,m} of Figure 5.8 at the grid points, row by M, shape (n, n); NaN for m > M."""
        curves = self.f_low + self.values[:, :1] - self.values
        return np.where(np.tri(self.n, dtype=bool), curves, np.nan)

    @property
    def major_loop(self) -> tuple[Array, Array, Array]:
        """Inputs, rising branch and falling branch, shape (n,) each."""
        rising = self.f_low + self.values[:, 0]
        falling = self.f_low + self.span - self.values[-1]
        return self.grid, rising, falling

    @property
    def density(self) -> Array:
        """mu in the cells [unit of output per square of the input's], (n - 1, n - 1).

        Row by alpha, column by beta, NaN above the diagonal, whose cells are triangles of half the
        area. (2.2) integrates it with relays from 0 to 1; half of it is the mu of relays of -1 and
        1.
        """
        area = self.step**2 * (1.0 - 0.5 * np.eye(self.n - 1))
        return np.where(np.tri(self.n - 1, dtype=bool), cells(self.values) / area, np.nan)

    @property
    def negative_share(self) -> float:
        """Share of the relays' weight that has the wrong sign; 0 for an ideal Preisach model."""
        weights = cells(self.values) / self.span
        return float(-np.minimum(weights, 0.0).sum() / np.abs(weights).sum())

    def everett(self) -> Everett:
        """The normalised table, for `memory`.

        Returns
        -------
        Everett
            Outputs from 0 to 1.

        Raises
        ------
        ProblemError
            A branch would turn back.
        """
        values = self.values / self.span
        slopes = np.concatenate([np.diff(values, axis=0).ravel(), -np.diff(values, axis=1).ravel()])
        if np.min(slopes) < -1e-12:
            remedy = "Make it with shape='monotone'."
            raise ProblemError("table", "the table is not monotone", remedy)
        return Everett(self.lo, self.step, self.n, values)

    def curve(self, start: float, inputs: npt.ArrayLike, kind: Kind | None = None) -> Array:
        """A first-order curve of the table.

        Parameters
        ----------
        start : float
            Input of its reversal, unit of the input; clamped to the table.
        inputs : array_like, any shape
            Where it is evaluated; inputs beyond `start` or beyond the table count as its ends.
        kind : Kind | None, optional
            "descending" or "ascending"; None for the table's.

        Returns
        -------
        ndarray
            Outputs, in the shape of `inputs`.
        """
        u = np.asarray(inputs, dtype=np.float64)
        flat = np.ravel(u)
        first = np.full(flat.shape, min(max(start, self.lo), self.hi))
        grid, ids = Grid(self.lo, self.step, self.n), number_nodes(self.n)
        known = self.values[ids >= 0]
        if (kind or self.kind) == "descending":
            ends = np.full(flat.shape, self.lo)
            rise = readings(grid, ids, first, ends) @ known
            f = self.f_low + rise - readings(grid, ids, first, np.minimum(flat, first)) @ known
        else:
            ends = np.full(flat.shape, self.hi)
            fall = readings(grid, ids, ends, first) @ known
            rise = readings(grid, ids, np.maximum(flat, first), first) @ known
            f = self.f_low + self.span - fall + rise
        return np.asarray(f, dtype=np.float64).reshape(u.shape)

    def misfit(self, curves: Iterable[tuple[npt.ArrayLike, npt.ArrayLike]] | None = None) -> Misfit:
        """Distance from first-order curves of the table's kind.

        Parameters
        ----------
        curves : Iterable[tuple[npt.ArrayLike, npt.ArrayLike]] | None, optional
            Pairs of input and output, shape (m,) each; None for its own.

        Returns
        -------
        Misfit
            In the unit of the output.

        Raises
        ------
        InputError
            `curves` are refused by `curves.tidy`.
        """
        errors = []
        sign = 1.0 if self.kind == "descending" else -1.0
        for u, f in tidy(self.raw if curves is None else curves, self.kind):
            errors.append(self.curve(sign * u[0], sign * u) - sign * f)
        error = np.concatenate(errors)
        rms = float(np.sqrt(np.mean(error**2)))
        return Misfit(rms, float(np.max(np.abs(error))), int(error.size))


def _check_words(kind: str, shape: str, between: str) -> None:
    for name, value, accepted in (
        ("kind", kind, KINDS), ("shape", shape, SHAPES), ("between", between, BETWEENS)
    ):  # fmt: skip
        if value not in accepted:
            raise InputError(f"table, {name}", value, " or ".join(map(repr, accepted)))


def _grid(curves: list[Curve], sign: float, nodes: int, limits: tuple[float, float] | None) -> Grid:
    """The grid over the data, or over `limits` in the user's direction."""
    lo = min(float(curve.u[-1]) for curve in curves)
    hi = max(float(curve.u[0]) for curve in curves)
    if limits is not None:
        first, last = sorted(sign * float(limit) for limit in limits)
        if not (first <= lo and last >= hi):
            shown = sorted((sign * lo, sign * hi))
            raise InputError("table, limits", limits, f"inputs that hold the data, {shown}")
        lo, hi = first, last
    return Grid(lo, (hi - lo) / (nodes - 1), nodes)
