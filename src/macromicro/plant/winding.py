"""A motor's constant and resistance from the figures of a hobby motor's sheet."""

from __future__ import annotations

from macromicro.errors import ProblemError
from macromicro.schema.par import Par

_SHEET = "motor's data sheet"
WINDING = {
    "voltage": Par("V", "voltage of the following figures", _SHEET, positive=True),
    "stall_current": Par("A", "current at standstill", _SHEET, positive=True),
    "no_load_speed": Par(
        "rad/s", "speed of the motor's shaft without a load", _SHEET, shown="rpm", positive=True
    ),
    "no_load_current": Par("A", "current without a load; 0 if left out", _SHEET, lo=0.0),
}


def winding(given: dict[str, float], where: str) -> dict[str, float]:
    """R = V / i_stall, and K = (V - R i_0) / speed."""
    missing = [name for name in WINDING if name not in given and name != "no_load_current"]
    if missing:
        problem = f"{', '.join(given)} without {' and '.join(missing)}"
        raise ProblemError(where, problem, "Give voltage, stall_current and no_load_speed.")
    volts, idle = given["voltage"], given.get("no_load_current", 0.0)
    resistance = volts / given["stall_current"]
    if idle >= given["stall_current"]:
        problem = "no_load_current is not below stall_current"
        raise ProblemError(where, problem, "Check which is which.")
    return {
        "constant": (volts - resistance * idle) / given["no_load_speed"],
        "resistance": resistance,
    }
