"""Kernels of other packages: what is compiled with ours is kept beside their own sources."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from macromicro import kernel

_modules: set[str] = set()  # of kernels that `joined`


def admitted(name: str, *functions: Callable[..., Any]) -> None:
    """Kernels of another package join what is compiled here (`kernel.admit`).

    Parameters
    ----------
    name : str
        What joins.
    *functions : Callable[..., Any]
        Kernels; their files, packages and all other foreign kernels are looked at.
    """
    kernel.admit(name, sources(*functions))


def foreign(function: Callable[..., Any]) -> bool:
    """Whether a function is of another package.

    Parameters
    ----------
    function : Callable[..., Any]
        Any.

    Returns
    -------
    bool
        False for one of this package.
    """
    return function.__module__.partition(".")[0] != __name__.partition(".")[0]


def sources(*functions: Callable[..., Any], also: bool = True) -> str:
    """What the sources of some functions are: an edit makes another digest.

    Parameters
    ----------
    *functions : Callable[..., Any]
        Their files and packages are looked at.
    also : bool, optional
        Whether all other foreign kernels are looked at, too, as they may be called.

    Returns
    -------
    str
        16 hexadecimal digits.
    """
    files = (kernel.foreign() if also else set()) | _homes(functions)
    found = hashlib.sha256()
    for source in sorted(files):
        found.update(source.read_bytes())
    return found.hexdigest()[:16]


def joined(*functions: Callable[..., Any]) -> None:
    """Those of some kernels that are of other packages join; before they are compiled with ours.

    Parameters
    ----------
    *functions : Callable[..., Any]
        Any functions.
    """
    for each in functions:
        module = each.__module__
        if foreign(each) and module not in _modules:
            _modules.add(module)
            admitted(module, each)


def _homes(functions: Iterable[Callable[..., Any]]) -> set[Path]:
    """The files of functions of another package, with the rest of their packages."""
    files = set()
    for function in functions:
        files.add(Path(inspect.getfile(function)))
        top = sys.modules.get(function.__module__.partition(".")[0])
        for folder in getattr(top, "__path__", ()):
            files |= set(Path(folder).rglob("*.py"))
    return files
