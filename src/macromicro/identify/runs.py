"""Run: one checked measurement of an axis: time, voltage (or force) and position."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.errors import InputError, ProblemError
from macromicro.identify.notices import ResampledWarning, notice
from macromicro.identify.records import GAP, signal
from macromicro.recording import Recording

_EVEN = 0.02  # a time step this part off the median is even enough


class Run(NamedTuple):
    """One measurement of an axis.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import Run
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> Run(t, u=0.0 * t + 1.5, x=20.0 * t).dt  # s
    0.01
    """

    t: Array  #: s, evenly spaced
    u: Array  #: voltage or force, the caller's unit
    x: Array  #: position, the caller's unit

    @property
    def dt(self) -> float:
        """Sample time [s]."""
        return float(self.t[-1] - self.t[0]) / (len(self.t) - 1)

    def part(self, first: int | None, last: int | None) -> Run:
        """Rows of the run.

        Parameters
        ----------
        first, last : int | None
            Rows from `first` on, before `last`, as in a slice.

        Returns
        -------
        Run
            Views of its columns.
        """
        return Run(self.t[first:last], self.u[first:last], self.x[first:last])

    @classmethod
    def of(cls, recording: Recording, u: str = "motor", x: str = "macro_position") -> Run:
        """A recording's columns, checked.

        Parameters
        ----------
        recording : Recording
            Recording with the column t and the two below.
        u, x : str, optional
            Names of columns.

        Returns
        -------
        Run
            The run.

        Raises
        ------
        InputError
            A column is missing or unusable.
        """
        return checked(recording["t"], recording[u], recording[x])


def as_run(item: Any, where: str) -> Run:
    """A checked run from a recording or from three arrays.

    Parameters
    ----------
    item : Any
        A `Recording`, or (t, u, x).
    where : str
        Name, for messages.

    Returns
    -------
    Run
        The run.

    Raises
    ------
    InputError
        `item` is neither, or unusable.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify.runs import as_run
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> run = as_run((t, 0.0 * t + 1.5, 20.0 * t), "recordings[0]")
    >>> len(run.t), run.dt  # s
    (101, 0.01)
    """
    if isinstance(item, Recording):
        return Run.of(item)
    try:
        t, u, x = item
    except (TypeError, ValueError):
        raise InputError(where, type(item).__name__, "a Recording or arrays (t, u, x)") from None
    return checked(t, u, x, where)


def checked(t: Any, u: Any, x: Any, where: str = "run", least: int = 20) -> Run:
    """A run from three arrays of one length.

    Uneven time stamps are interpolated onto an even grid, with a `ResampledWarning`.

    Parameters
    ----------
    t : array_like, shape (n,)
        Times, s.
    u, x : Any
        Voltage or force, and position; array_like, shape (n,).
    where : str, optional
        Name, for messages.
    least : int, optional
        Fewest samples.

    Returns
    -------
    Run
        The run.

    Raises
    ------
    InputError
        Unequal or non-finite arrays, time that does not increase, or too few samples.
    ProblemError
        A missing array, or a gap in the time.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify.runs import checked
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> checked(t, 0.0 * t + 1.5, 20.0 * t).dt  # s
    0.01
    """
    for name, values in (("t", t), ("u", u), ("x", x)):
        if values is None:
            remedy = "Give an array of numbers."
            raise ProblemError(f"{where}.{name}", "the array is missing", remedy)
    tt, uu, xx = (signal(v, f"{where}.{n}") for v, n in ((t, "t"), (u, "u"), (x, "x")))
    if not len(tt) == len(uu) == len(xx):
        found = f"t, u and x have {len(tt)}, {len(uu)} and {len(xx)} rows"
        raise ProblemError(where, found, "Give as many of each.")
    if len(tt) < least:
        raise ProblemError(where, f"{len(tt)} samples were given", f"Give {least} samples or more.")
    return Run(*_even(tt, uu, xx, where))


def _even(t: Array, u: Array, x: Array, where: str) -> tuple[Array, Array, Array]:
    """The run on an even time grid."""
    steps = np.diff(t)
    if steps.min() <= 0.0:
        row = int(steps.argmin()) + 1
        found = f"{t[row]:g} s follows {t[row - 1]:g} s"
        raise ProblemError(f"{where}.t", found, "Give times that increase.")
    row, shortest, longest = int(steps.argmax()), float(steps.min()), float(steps.max())
    usual = float(np.median(steps, overwrite_input=True))  # no copy: records may be long
    if longest > GAP * usual:
        problem = f"there is a gap of {longest:g} s after {t[row]:g} s (usual step {usual:g} s)"
        raise ProblemError(f"{where}.t", problem, "Cut the record there.")
    if max(longest - usual, usual - shortest) <= _EVEN * usual:
        return t, u, x
    grid = np.linspace(t[0], t[-1], round((t[-1] - t[0]) / usual) + 1)
    notice(
        ResampledWarning,
        f"{where}: time steps from {shortest:g} to {longest:g} s; interpolated onto "
        f"{len(grid)} samples {usual:g} s apart (the input held, the position linear)",
    )
    held = u[np.clip(np.searchsorted(t, grid, side="right") - 1, 0, len(u) - 1)]
    return grid, held, np.interp(grid, t, x)
