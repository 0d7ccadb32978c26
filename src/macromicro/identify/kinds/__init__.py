"""The kinds of identification from files: from columns of data to a model and its uncertainty.

Each kind is a module with `Options` and ``identify(picking, options) -> Result``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from os import PathLike, fspath
from typing import Any

from macromicro.errors import InputError
from macromicro.identify.kinds.loading import Picking, there
from macromicro.identify.picking import chosen
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
        One or several files of measured data, as docs/files.md describes them.
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
    """
    names = [files] if isinstance(files, str | PathLike) else list(files)
    pairs = [f"{role}={name}" for role, name in (columns or {}).items()]
    return fitted(kind, Picking(there([fspath(n) for n in names]), chosen(pairs)), **options)


def fitted(kind: str, what: Picking, **options: Any) -> Result:
    """`from_files` with files and columns as a command line's are read.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    what : Picking
        Files, and role to column.
    **options : Any
        Those of the kind's `Options`.

    Returns
    -------
    Result
        What was found, with the names of the files.

    Raises
    ------
    InputError
        As for `from_files`; for what no procedure foresaw in the data as well.
    """
    import numpy as np

    if kind not in KINDS:
        raise InputError("kind", kind, f"one of {', '.join(KINDS)}")
    module = import_module(f"{__name__}.{kind}")
    for name in options:
        if name not in module.Options._fields:
            raise InputError(f"{kind}, option", name, ", ".join(module.Options._fields))
    try:
        found: Result = module.identify(what, module.Options(**options))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
        where = printable(what.files[0], 300)
        accepted = "data of the kind that docs/identify.md describes"
        raise InputError(where, f"cannot be fitted: {error}", accepted) from error
    found.files = tuple(map(str, what.files))
    return found
