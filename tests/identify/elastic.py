"""A stage on plain bearings that gives by 0.1 mm before it slides."""

from __future__ import annotations

import numpy as np

from macromicro.identify.presliding import Presliding

DT = 1e-3
STAGE = Presliding(
    mass=2.0,
    viscous=15.0,
    offset=0.3,
    asymmetry=0.0,
    stribeck=0.0,
    stribeck_speed=0.01,
    stiffness=5e4,
    settling=4e-3,
    levels=np.array([5.0]),
    low=-1.0,
    high=1.0,
)
