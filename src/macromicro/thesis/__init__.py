"""The thesis' laboratory: a folder per chapter with its procedures, claims and figures.

Only `reproduce` and `collect` use it; procedures are listed here in the thesis' order.
"""

from __future__ import annotations

from importlib import import_module

from macromicro.thesis.procedure import Procedure

NAMES = (
    "chapter2.technologies",
    "chapter2.actuator_principle",
    "chapter2.preisach_geometry",
    "chapter3.sensor_design",
    "chapter3.hall_calibration",
    "appendix_c.channels",
    "chapter4.friction",
    "chapter4.identification",
    "chapter4.control",
    "chapter5.kiln",
    "chapter5.electrothermal",
    "chapter5.micro_control",
    "chapter6.integrated",
    "chapter6.laser_noise",
    "appendix_d.cycle_testing",
)


def all_procedures() -> list[Procedure]:
    return [import_module(f"{__name__}.{name}").PROCEDURE for name in NAMES]
