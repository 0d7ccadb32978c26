"""Optional packages."""

from __future__ import annotations

from importlib import import_module

from macromicro.errors import ProblemError


class MissingPackageError(ProblemError):
    """An optional package is not installed."""


def remedy(extra: str) -> str:
    """How to install one of the package's extras."""
    return f"pip install 'macromicro[{extra}]'"


def require(where: str, package: str, extra: str) -> None:
    """Refuse to go on without an optional package; name the extra that brings it."""
    try:
        import_module(package)
    except ImportError:
        problem = f"{package} is not installed"
        raise MissingPackageError(where, problem, f"Install it: {remedy(extra)}") from None
