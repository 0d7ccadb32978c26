"""Design sheets, and measures of a response: settling, residual vibration, return to zero.

The names below are the sheets', loaded when first used. Measures are imported from their own
modules: `response`, `vibration`, `extension`, `margins`.
"""

from typing import TYPE_CHECKING

from macromicro.lazy import front_door

if TYPE_CHECKING:
    from macromicro.design.costs import MICRO_STAGE as MICRO_STAGE
    from macromicro.design.costs import TABLE_2_1 as TABLE_2_1
    from macromicro.design.costs import TABLE_6_2 as TABLE_6_2
    from macromicro.design.costs import Comparison as Comparison
    from macromicro.design.costs import Technology as Technology
    from macromicro.design.costs import compare as compare
    from macromicro.design.costs import micro_stage as micro_stage
    from macromicro.design.costs import total as total
    from macromicro.design.flexure_sheet import GRAM_FORCE as GRAM_FORCE
    from macromicro.design.flexure_sheet import Beam as Beam
    from macromicro.design.flexure_sheet import bending_stress as bending_stress
    from macromicro.design.flexure_sheet import deflection as deflection
    from macromicro.design.flexure_sheet import max_thickness as max_thickness
    from macromicro.design.flexure_sheet import stiffness as stiffness
    from macromicro.design.hall_sensors import TABLE_3_2 as TABLE_3_2
    from macromicro.design.hall_sensors import Needs as Needs
    from macromicro.design.hall_sensors import Sensor as Sensor
    from macromicro.design.hall_sensors import judge as judge
    from macromicro.design.hall_sensors import suitable as suitable
    from macromicro.design.magnets import INCH as INCH
    from macromicro.design.magnets import TABLE_3_1 as TABLE_3_1
    from macromicro.design.magnets import Change as Change
    from macromicro.design.magnets import Magnet as Magnet
    from macromicro.design.magnets import largest_change as largest_change
    from macromicro.design.magnets import ranking as ranking
    from macromicro.design.resolution import Budget as Budget
    from macromicro.design.resolution import budget as budget
    from macromicro.design.resolution import calibrated as calibrated
    from macromicro.design.resolution import converter as converter
    from macromicro.design.resolution import sensitivity_floor as sensitivity_floor

# The public names of each module. For type checkers: also import them above.
_NAMES = {
    "costs": (
        "Comparison", "MICRO_STAGE", "TABLE_2_1", "TABLE_6_2", "Technology", "compare",
        "micro_stage", "total",
    ),
    "flexure_sheet": (
        "Beam", "GRAM_FORCE", "bending_stress", "deflection", "max_thickness", "stiffness",
    ),
    "hall_sensors": ("Needs", "Sensor", "TABLE_3_2", "judge", "suitable"),
    "magnets": ("Change", "INCH", "Magnet", "TABLE_3_1", "largest_change", "ranking"),
    "resolution": ("Budget", "budget", "calibrated", "converter", "sensitivity_floor"),
}  # fmt: skip
_HOMES = dict(sorted((name, module) for module, names in _NAMES.items() for name in names))

__getattr__, __dir__ = front_door(__name__, _HOMES)
