"""Versions and machine of a report."""

from __future__ import annotations

import platform
from importlib import metadata

import macromicro

_LIBRARIES = ("numpy", "numba", "scipy", "h5py", "matplotlib")


def software() -> list[tuple[str, str]]:
    return [
        ("macromicro", macromicro.__version__),
        ("Python", platform.python_version()),
        ("libraries", ", ".join(f"{name} {_version(name)}" for name in _LIBRARIES)),
        ("machine", f"{platform.system()} {platform.machine()}"),
    ]


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "unknown"
