"""The thesis' laboratory procedures, one file each with a `PROCEDURE`; listed here in the
thesis' order."""

from __future__ import annotations

from importlib import import_module

from macromicro.experiments.procedure import Procedure

NAMES = (
    "technologies",
    "actuator_principle",
    "preisach_geometry",
    "sensor_design",
    "hall_calibration",
    "channels",
    "macro_friction",
    "macro_identification",
    "macro_control",
    "kiln",
    "electrothermal",
    "micro_control",
    "integrated",
    "laser_noise",
    "cycle_testing",
)


def all_procedures() -> list[Procedure]:
    """Every procedure, in the thesis' order."""
    return [import_module(f"{__name__}.{name}").PROCEDURE for name in NAMES]
