"""Motion profiles: position over time within limits of velocity, acceleration and jerk.

Closed forms in SI units, time-optimal under their limits, for any axis. A `Trajectory` is a
profile, a function or a file, sampled at a control period.
"""

from macromicro.motion._shapes import s_curve, trapezoid
from macromicro.motion._trajectory import Trajectory
from macromicro.motion._via import through
from macromicro.motion.profile import Motion, Profile, Segment

__all__ = ["Motion", "Profile", "Segment", "Trajectory", "s_curve", "through", "trapezoid"]
