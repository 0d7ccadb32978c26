"""Compiles kernels of other packages, cached beside their sources."""

from __future__ import annotations

import hashlib
import inspect
import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from macromicro import kernel

_modules: set[str] = set()  # of kernels that `joined`


def admit(name: str, *functions: Callable[..., Any]) -> None:
    """Let kernels of another package join the compilation (`kernel.admit`)."""
    kernel.admit(name, sources(*functions))


def foreign(function: Callable[..., Any]) -> bool:
    return function.__module__.partition(".")[0] != __name__.partition(".")[0]


def sources(*functions: Callable[..., Any], also: bool = True) -> str:
    """Digest of functions' sources."""
    files = (kernel.foreign() if also else set()) | _homes(functions)
    found = hashlib.sha256()
    for source in sorted(files):
        found.update(source.read_bytes())
    return found.hexdigest()[:16]


def join(*functions: Callable[..., Any]) -> None:
    """Admit those kernels that are of other packages, before compilation."""
    for each in functions:
        module = each.__module__
        if foreign(each) and module not in _modules:
            _modules.add(module)
            admit(module, each)


def _homes(functions: Iterable[Callable[..., Any]]) -> set[Path]:
    """Source files of functions of another package."""
    files = set()
    for function in functions:
        files.add(Path(inspect.getfile(function)))
        top = sys.modules.get(function.__module__.partition(".")[0])
        for folder in getattr(top, "__path__", ()):
            files |= set(Path(folder).rglob("*.py"))
    return files
