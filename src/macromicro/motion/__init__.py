"""Motion profiles: position over time within limits of velocity, acceleration and jerk.

Closed forms in SI units, time-optimal under their limits, for any axis; nothing here knows this
positioner. A `Trajectory` is one of them, a function or a file, sampled at a control period.
"""

from macromicro.motion.profile import Motion, Profile, Segment
from macromicro.motion.shapes import s_curve, trapezoid
from macromicro.motion.trajectory import Trajectory
from macromicro.motion.via import through

__all__ = ["Motion", "Profile", "Segment", "Trajectory", "s_curve", "through", "trapezoid"]
