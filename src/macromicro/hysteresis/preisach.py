"""The Preisach model (2.11) of a table, in the user's units: forward and inverse."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis.everett import Everett
from macromicro.hysteresis.invert import follow, follow_inverse, invert, maximum_for
from macromicro.hysteresis.memory import AT_DOWN, DOWN, UP, Memory, advance, peek
from macromicro.hysteresis.shape import cells
from macromicro.hysteresis.table import FodTable
from macromicro.kernel import compiled

Start = Literal["negative", "positive", "demagnetised"]
# Shorter arrays are done before a compiler would be loaded; the bits are the same.
WORTH_COMPILING = 2000


class Inverse(NamedTuple):
    """The input for a target.

    Examples
    --------
    >>> from macromicro.hysteresis import Preisach, from_density
    >>> table = from_density([[1.0, 0.0], [1.0, 1.0]], lo=0.0, step=5.0, n=3)
    >>> found = Preisach(table).inverse(0.5)
    >>> round(found.u, 3), round(found.error, 9)
    (6.25, 0.0)
    """

    u: float  #: unit of the input
    f: float  #: the output that it gives
    error: float  #: output less target


class Preisach:
    """A hysteretic element with the density of `table` and a memory of its input's past (2.11).

    Starts in negative saturation at the table's lowest input. Inputs beyond the table count as its
    ends.

    Parameters
    ----------
    table : FodTable | Everett
        In the user's units, or normalised (outputs 0 to 1).

    Raises
    ------
    InputError
        `table` is neither a `FodTable` nor an `Everett` table.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.hysteresis import Preisach, from_density
    >>> table = from_density(lambda alpha, beta: np.ones_like(alpha), lo=0.0, step=1.0, n=11)
    >>> element = Preisach(table)
    >>> [round(element.step(u), 6) for u in (8.0, 2.0)]
    [0.64, 0.28]
    """

    def __init__(self, table: FodTable | Everett) -> None:
        if isinstance(table, Everett):
            table = FodTable.from_everett(table)
        if not isinstance(table, FodTable):
            raise InputError("Preisach, table", type(table).__name__, "a FodTable")
        self.table = table
        # With weights of both signs the output may leave the saturations. Scaled so that all
        # positive and all negative relays together span 0 to 1, it stays inside, and a
        # density of at least 0 keeps its own scale.
        weights = cells(table.values) / table.span
        below = float(-np.minimum(weights, 0.0).sum())
        all_of_it = 1.0 + 2.0 * below if below > 1e-9 else 1.0
        self._base = below / all_of_it if below > 1e-9 else 0.0
        self._scale = table.span * all_of_it
        self._offset = table.f_low - self._base * self._scale
        values = np.ascontiguousarray(table.values / self._scale)
        self._arrays = Everett(table.lo, table.step, table.n, values)
        self._corners = np.zeros((max(256, table.n) + 1, 4))
        self._corners[0] = (math.inf, -math.inf, self._base, self._base)
        self.reset()

    def _memory(self) -> Memory:
        """The state for the kernels, with room for one more move."""
        if self._pairs >= len(self._corners) - 1:
            self._corners = np.concatenate([self._corners, np.zeros_like(self._corners)])
        return Memory(self._corners, self._pairs, self._u)

    @property
    def u(self) -> float:
        """The present input, within the table."""
        return self._u

    @property
    def f(self) -> float:
        """The present output."""
        return self._offset + self._scale * float(self._corners[self._pairs, AT_DOWN])

    def reset(self, start: Start = "negative") -> None:
        """Forget the past: both saturations, or the demagnetised state at mid-input.

        The demagnetised state follows a decaying swing about the middle of the table, with as many
        relays up as down on either side of the anti-diagonal of the Preisach plane. For a swing
        about another input, give the table `limits` that are symmetric about it.

        Parameters
        ----------
        start : Start, optional
            "negative", "positive" or "demagnetised".

        Raises
        ------
        InputError
            Another `start`.
        """
        if start not in ("negative", "positive", "demagnetised"):
            accepted = "'negative', 'positive' or 'demagnetised'"
            raise InputError("Preisach.reset", start, accepted)
        self._pairs, self._u = 0, -math.inf
        self.step(self.table.lo)
        if start == "positive":
            self.step(self.table.hi)
        elif start == "demagnetised":
            for u in demagnetising(self.table.lo, self.table.step, self.table.n):
                self.step(u)

    def step(self, u: float) -> float:
        """Move the input straight to `u`.

        Parameters
        ----------
        u : float
            Unit of the table's input.

        Returns
        -------
        float
            The output there, unit of the table's output.

        Raises
        ------
        InputError
            NaN.
        """
        if math.isnan(u):
            raise InputError("Preisach.step, input", u, "a number")
        memory, f = advance(self._arrays, self._memory(), u)
        self._pairs, self._u = memory.pairs, memory.u
        return self._offset + self._scale * f

    def run(self, u: npt.ArrayLike) -> Array:
        """Outputs along inputs, from the present state on; compiled for long ones.

        Parameters
        ----------
        u : array_like, shape (m,)
            Unit of the table's input.

        Returns
        -------
        ndarray, shape (m,)
            Unit of the table's output.

        Raises
        ------
        InputError
            NaN (nothing is done then), or another shape.
        """
        inputs = _vector("Preisach.run, inputs", u)
        outputs = np.empty_like(inputs)
        walk = compiled(follow) if inputs.size >= WORTH_COMPILING else follow
        done = 0
        while done < inputs.size:
            memory, done = walk(
                self._arrays, self._memory(), inputs, outputs, done, self._scale, self._offset
            )
            self._pairs, self._u = memory.pairs, memory.u
        return outputs

    def peek(self, u: float) -> float:
        """The output if the input moved straight to `u`; the state stays as it is.

        Parameters
        ----------
        u : float
            Unit of the table's input.

        Returns
        -------
        float
            Unit of the table's output.

        Raises
        ------
        InputError
            NaN.
        """
        if math.isnan(u):
            raise InputError("Preisach.peek, input", u, "a number")
        return self._offset + self._scale * float(peek(self._arrays, self._memory(), u))

    def inverse(self, target: float) -> Inverse:
        """The input that brings the output to `target` in one move from the present state.

        Parameters
        ----------
        target : float
            Unit of the table's output.

        Returns
        -------
        Inverse
            The error is rounding where the target is reachable, else the distance to saturation.

        Raises
        ------
        InputError
            NaN.
        """
        if math.isnan(target):
            raise InputError("Preisach.inverse, target", target, "a number")
        u = invert(self._arrays, self._memory(), (target - self._offset) / self._scale)
        f = self.peek(u)
        return Inverse(u, f, f - target)

    def run_inverse(self, targets: npt.ArrayLike) -> tuple[Array, Array]:
        """Inputs that lead the output through targets, each found as by `inverse` and then applied.

        Parameters
        ----------
        targets : array_like, shape (m,)
            Unit of the table's output.

        Returns
        -------
        inputs, outputs : ndarray, shape (m,)
            In the units of the table.

        Raises
        ------
        InputError
            NaN, or another shape.
        """
        shares = (_vector("Preisach.run_inverse, targets", targets) - self._offset) / self._scale
        inputs, outputs = np.empty_like(shares), np.empty_like(shares)
        walk = compiled(follow_inverse) if shares.size >= WORTH_COMPILING else follow_inverse
        done = 0
        while done < shares.size:
            memory, done = walk(self._arrays, self._memory(), shares, inputs, outputs, done)
            self._pairs, self._u = memory.pairs, memory.u
        return inputs, self._offset + self._scale * outputs

    def initialise_at(self, u: float, f: float) -> None:
        """Take a state with a given input and output: on a first-order descending curve.

        Parameters
        ----------
        u, f : float
            Input and output, in the units of the table.

        Raises
        ------
        InputError
            An input outside the table, or an output that no such curve has there.
        """
        table = self.table
        if not table.lo <= u <= table.hi:
            accepted = f"{table.lo:g} to {table.hi:g}"
            raise InputError("Preisach.initialise_at, input", u, accepted)
        share = (f - table.f_low) / self._scale
        _, rising, falling = (np.interp(u, table.grid, side) for side in table.major_loop)
        slack = 1e-12 * abs(table.span)
        for edge, top in ((rising, u), (falling, table.hi)):
            if abs(f - edge) <= slack:
                self._from_maximum(top, u)
                return
        top = maximum_for(self._arrays, u, share) if math.isfinite(f) else math.nan
        if math.isnan(top):
            low, high = sorted((float(rising), float(falling)))
            accepted = f"{low:g} to {high:g} at input {u:g}"
            raise InputError("Preisach.initialise_at, output", f, accepted)
        self._from_maximum(top, u)

    def _from_maximum(self, top: float, u: float) -> None:
        self.reset()
        self.step(top)
        self.step(u)

    @property
    def corners(self) -> Array:
        """(M_k, m_k) of Figure 2.17, shape (pairs, 2), [unit of the input]; a copy."""
        return self._corners[1 : self._pairs + 1, [UP, DOWN]].copy()

    @property
    def state(self) -> dict[str, list[float]]:
        """All that counts of the past, as plain lists: `maxima` M_k and `minima` m_k."""
        corners = self.corners
        return {"maxima": corners[:, 0].tolist(), "minima": corners[:, 1].tolist()}

    @state.setter
    def state(self, state: Mapping[str, Any]) -> None:
        where = "Preisach.state"
        try:
            maxima = _vector(where, state["maxima"])
            minima = _vector(where, state["minima"])
        except (KeyError, TypeError):
            remedy = "Give a state that was saved."
            raise ProblemError(where, "maxima or minima are missing", remedy) from None
        nested = (
            maxima.size == minima.size >= 1
            and np.all(np.diff(maxima) < 0.0)
            and np.all(np.diff(minima) > 0.0)
            and minima[-1] <= maxima[-1]
            and maxima[0] <= self.table.hi
            and minima[0] >= self.table.lo
        )
        if not nested:
            remedy = "Give equally many, maxima falling, minima rising, within the table."
            raise ProblemError(where, "the corners are out of order", remedy)
        self.reset()
        for top, low in zip(maxima.tolist(), minima.tolist(), strict=True):
            self.step(top)
            self.step(low)

    def copy(self) -> Self:
        """Another element of the same table in the same state.

        Returns
        -------
        Self
            Independent of this one.
        """
        other = type(self)(self.table)
        other.state = self.state
        return other


def demagnetising(lo: float, step: float, n: int) -> list[float]:
    """Turning points of a swing that decays by one grid step per turn to the middle."""
    # Maxima lie on grid lines, minima half way between, so cells on the anti-diagonal are left half
    # up: no direction is favoured.
    turns: list[float] = []
    for k in range(n):
        top, low = lo + (n - 1 - k) * step, lo + (k + 0.5) * step
        if k > 0 and top <= turns[-1]:
            break
        turns.append(top)
        if low >= top:
            break
        turns.append(low)
    return turns


def _vector(where: str, values: npt.ArrayLike) -> Array:
    try:
        vector = np.asarray(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(where, type(values).__name__, "a list of numbers") from None
    if vector.ndim != 1:
        raise ProblemError(where, f"the shape is {vector.shape}", "Give one dimension.")
    # The least value is NaN if any is, and finding it makes no array of its own.
    if vector.size and np.isnan(vector.min()):
        first = int(np.argmax(np.isnan(vector)))
        raise ProblemError(where, f"[{first}] is NaN", "Remove or repair it.")
    return vector
