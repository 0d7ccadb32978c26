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

KINDS = ("drive", "linear", "deadzone", "hysteresis", "thermal", "hall")


def from_files(
    kind: str,
    files: str | PathLike[str] | Sequence[str | PathLike[str]],
    columns: Mapping[str, str] | None = None,
    **options: Any,
) -> Result:
    """Identify from measured data in files, as ``macromicro identify KIND FILE...`` does.

    Parameters
    ----------
    kind : one of `KINDS`: drive, linear, deadzone, hysteresis, thermal or hall.
    files : one or several recordings of this package, CSV, MAT or MicroMag files.
    columns : which column is what, such as ``{"x": "position_mm:mm"}``.
    options : those of the kind's `Options`, such as ``gain=35.15`` of a drive.

    Returns
    -------
    Result, with `.model`, `.uncertainty`, `.to_toml()`, `.plot()` and `.save(folder)`.

    Raises
    ------
    InputError
        An unknown kind, option or column, a file that cannot be read or identified from.
    """
    if kind not in KINDS:
        raise InputError("kind", kind, f"one of {', '.join(KINDS)}")
    module = import_module(f"{__name__}.{kind}")
    for name in options:
        if name not in module.Options._fields:
            raise InputError(f"{kind}, option", name, ", ".join(module.Options._fields))
    names = [files] if isinstance(files, str | PathLike) else list(files)
    paths = there([fspath(name) for name in names])
    pairs = [f"{role}={name}" for role, name in (columns or {}).items()]
    found: Result = module.identify(Picking(paths, chosen(pairs)), module.Options(**options))
    found.files = tuple(str(path) for path in paths)
    return found
