"""The thesis' laboratory procedures, one file each with a `PROCEDURE`; listed here in the
thesis' order."""

from __future__ import annotations

from importlib import import_module

from macromicro.experiments.procedure import Procedure

NAMES = ("laser_noise",)


def all_procedures() -> list[Procedure]:
    """Every procedure, in the thesis' order."""
    return [import_module(f"{__name__}.{name}").PROCEDURE for name in NAMES]
