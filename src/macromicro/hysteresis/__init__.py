"""Hysteresis models: Preisach (Section 2.4.1) and Prandtl-Ishlinskii, forward and inverse.

`FodTable` and `Preisach` work in the units of the data; `everett` and `memory` are the kernels,
with the output from 0 to 1. `prandtl` is for loops without saturation, as of a piezo. Files and
pictures (`forc`, `table_files`, `pictures`) are imported from their modules.
"""

from macromicro.hysteresis.curves import CurveWarning
from macromicro.hysteresis.diagnostics import Deviation, congruency, wiping_out
from macromicro.hysteresis.everett import Everett, from_density, lookup
from macromicro.hysteresis.memory import Memory, advance, fresh, peek
from macromicro.hysteresis.preisach import Inverse, Preisach
from macromicro.hysteresis.table import FodTable, Misfit

__all__ = [
    "CurveWarning",
    "Deviation",
    "Everett",
    "FodTable",
    "Inverse",
    "Memory",
    "Misfit",
    "Preisach",
    "advance",
    "congruency",
    "fresh",
    "from_density",
    "lookup",
    "peek",
    "wiping_out",
]
