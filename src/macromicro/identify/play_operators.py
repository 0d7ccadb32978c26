"""Play operators in Python: from arrays, or from a result of `identify plays`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro.arrays import Array
from macromicro.errors import ProblemError
from macromicro.hysteresis import prandtl, prandtl_fit, prandtl_rate
from macromicro.hysteresis.prandtl import Prandtl
from macromicro.hysteresis.prandtl_fit import PLAYS, PrandtlFit
from macromicro.hysteresis.prandtl_rate import RateFit
from macromicro.identify.result import RESULT
from macromicro.schema.text import printable, read_text

_WHAT = f"{RESULT} of `identify plays`, or its folder"


class Loop(NamedTuple):
    """A loop that was identified by play operators.

    Examples
    --------
    >>> from macromicro.hysteresis import prandtl
    >>> from macromicro.identify import Loop
    >>> Loop(prandtl.operator([0.0, 10.0], [0.1, 0.05])).run([0.0, 50.0, 100.0])
    array([ 0. ,  7. , 14.5])
    """

    operator: Prandtl  #: in the units of the columns that it was identified from
    #: of the output behind it, s; None of a loop that does not depend on its rate
    lag: float | None = None

    def run(self, u: npt.ArrayLike, dt: float | None = None) -> Array:
        """The output along an input.

        Parameters
        ----------
        u : array_like, shape (n,)
            Input over time, unit of the input.
        dt : float | None, optional
            Sample time, s; needed where the loop depends on its rate.

        Returns
        -------
        ndarray, shape (n,)
            Unit of the output. Until the input has been to both ends of its range it depends on
            what was before: plays begin relaxed.

        Raises
        ------
        ProblemError
            The loop depends on its rate, and `dt` is missing.
        """
        inputs = np.ascontiguousarray(u, np.float64)
        if self.lag is None:
            return prandtl.run(self.operator, inputs, prandtl.relaxed(self.operator, inputs[0]))
        if dt is None:
            remedy = "Give it in s: this loop depends on its rate."
            raise ProblemError("dt", "the sample time is missing", remedy)
        return prandtl_rate.run(self.operator, self.lag, inputs, dt)


def plays(
    u: npt.ArrayLike,
    f: npt.ArrayLike,
    dt: float | None = None,
    *,
    count: int = PLAYS,
    held_out: float = 0.3,
) -> PrandtlFit | RateFit:
    """Play operators of a loop without saturation, such as a piezo's.

    `identify plays` fits the same from files.

    Parameters
    ----------
    u, f : array_like, shape (n,)
        Input and output over time, in any units.
    dt : float | None, optional
        Sample time, s: the loop may depend on its rate; None: it does not.
    count : int, optional
        Play operators, 2 to 200, the one without a threshold included.
    held_out : float, optional
        Share of the recording, at its end, that is predicted and not fitted to; 0 for none.

    Returns
    -------
    PrandtlFit | RateFit
        The operator and its residuals; with `dt` a `RateFit`, which has a lag beside it.

    Raises
    ------
    InputError
        As `macromicro.hysteresis.prandtl_fit.fit`.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.identify import plays
    >>> u = 50.0 - 50.0 * np.cos(np.linspace(0.0, 20.0, 2001))
    >>> found = plays(u, 2.0 * u + 1.0, count=4)
    >>> bool(abs(found.operator.weights.sum() - 2.0) < 1e-6)
    True
    """
    if dt is None:
        return prandtl_fit.fit(u, f, count, held_out)
    return prandtl_rate.fit(u, f, dt, count, held_out)


def load_plays(path: str | Path) -> Loop:
    """The loop that `identify plays` has written.

    Parameters
    ----------
    path : str | Path
        Its folder, or result.json in it.

    Returns
    -------
    Loop
        In the units of the columns that it was identified from.

    Raises
    ------
    ProblemError
        There is no such file, or it is of another kind.

    Examples
    --------
    >>> import json
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> from macromicro.identify import load_plays
    >>> data = dict(thresholds=[0, 10], weights=[0.1, 0.05], offset=0, widening=0, lag=None)
    >>> with TemporaryDirectory() as folder:  # what `identify plays --out FOLDER` writes
    ...     text = json.dumps({"kind": "plays", "data": data})
    ...     _ = Path(folder, "result.json").write_text(text)
    ...     loop = load_plays(folder)
    >>> loop.run([0.0, 50.0, 100.0, 50.0])
    array([ 0. ,  7. , 14.5,  8. ])
    """
    file = Path(path)
    file = file / RESULT if file.is_dir() else file
    where = printable(file, 300)
    text = read_text(file, _WHAT)
    try:
        content: Any = json.loads(text)
        kind, data = content["kind"], content["data"]
        numbers = (data[name] for name in ("thresholds", "weights", "offset", "widening"))
        found = Loop(prandtl.operator(*numbers), data["lag"])
    except (KeyError, TypeError, ValueError):  # no JSON, or another program's
        remedy = f"Name {_WHAT}."
        raise ProblemError(where, "the file is not a result of `identify plays`", remedy) from None
    if kind != "plays":
        remedy = f"Name {_WHAT}."
        raise ProblemError(where, f"the result is of `identify {printable(kind)}`", remedy)
    return found
