"""Hysteresis: Preisach (Section 2.4.1), an Everett table and a stack of reversals; play operators.

Relays are weighted by their thresholds; the output is the fraction of the weight that is
up, 0 to 1. `everett` holds the weights, `memory` the past.

In the units of measured data: `FodTable` is made from first-order curves, `Preisach` is
the model of a table, forward and inverse. `diagnostics` measures how far a recording is from
any Preisach model. Files and pictures are imported from their own modules, because models
and controllers import this package and open none: `forc` (MicroMag), `table_files` (HDF5,
CSV), `pictures`.

`prandtl` is the other model, for loops without saturation such as a piezo's, with its exact
inverse (`prandtl_inverse`) and its fit to any recording (`prandtl_fit`).
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
