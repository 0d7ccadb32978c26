"""Identification from files: each kind is a module with `Options` and `identify`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from os import PathLike, fspath
from typing import Any

from macromicro.errors import InputError, ProblemError, naming_arguments
from macromicro.identify.notices import PoorFitWarning, notice
from macromicro.identify.picking import Picking, parse_pairs, there
from macromicro.identify.result import Result
from macromicro.schema.text import printable

KINDS = (
    *("drive", "carriage", "linear", "deadzone", "hysteresis", "thermal", "actuator", "hall"),
    *("plays", "stress"),
)


def from_files(
    kind: str,
    files: str | PathLike[str] | Sequence[str | PathLike[str]],
    columns: Mapping[str, str] | None = None,
    **options: Any,
) -> Result:
    """Identify from measured data in files, as ``macromicro identify KIND FILE...`` does.

    Parameters
    ----------
    kind : str
        One of `KINDS`: drive, carriage, linear, deadzone, hysteresis, thermal, actuator, hall,
        plays or stress.
    files : str | PathLike[str] | Sequence[str | PathLike[str]]
        One or several files of measured data, as docs/identify.md describes them.
    columns : Mapping[str, str] | None, optional
        Which column is what, such as ``{"x": "position_mm:mm"}``.
    **options : Any
        Those of the kind's `Options`, such as ``gain=35.15`` of a drive.

    Returns
    -------
    Result
        With `.model`, `.uncertainty`, `.to_toml()`, `.plot()` and `.save(folder)`.

    Raises
    ------
    InputError
        An unknown kind, option or column, a file that cannot be read or identified from.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import numpy as np
    >>> from macromicro.identify import from_files
    >>> volts = 50.0 - 50.0 * np.cos(np.linspace(0.0, 20.0, 2001))
    >>> with TemporaryDirectory() as folder:
    ...     file, rows = Path(folder, "loop.csv"), np.c_[volts, 0.1 * volts]
    ...     np.savetxt(file, rows, delimiter=",", header="drive_V,gauge_um", comments="")
    ...     result = from_files("plays", file, {"u": "drive_V", "f": "gauge_um"})
    >>> round(float(result.model.weights.sum()), 3)  # um/V
    0.1
    """
    names = [files] if isinstance(files, str | PathLike) else list(files)
    pairs = [f"{role}={name}" for role, name in (columns or {}).items()]
    with naming_arguments():
        return fit(kind, Picking(there([fspath(n) for n in names]), parse_pairs(pairs)), **options)


def fit(kind: str, what: Picking, **options: Any) -> Result:
    import numpy as np

    if kind not in KINDS:
        raise InputError("kind", kind, f"one of {', '.join(KINDS)}")
    module = import_module(f"{__name__}.{kind}")
    for name in options:
        if name not in module.Options._fields:
            raise InputError(f"{kind}, option", name, ", ".join(module.Options._fields))
    try:
        found: Result = module.identify(what, module.Options(**options))
    except InputError as error:
        if error.where.startswith("--") or error.where in module.Options._fields:
            raise
        names = [printable(file, 300) for file in what.files]
        if any(name in error.where for name in names):
            raise
        first = f"{names[0]} and {len(names) - 1} more" if len(names) > 1 else names[0]
        raise error.at(f"{first}, {error.where}") from None
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        where = printable(what.files[0], 300)
        remedy = "docs/identify.md describes the data that each kind needs."
        raise ProblemError(where, f"the data cannot be fitted: {error}", remedy) from error
    found.files = tuple(map(str, what.files))
    if not found.holds:
        text = "the free simulation is farther from the record than a constant: nothing here holds"
        notice(PoorFitWarning, text)
    return found
