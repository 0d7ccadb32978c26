"""The friction that a run has found becomes that of the next one."""

import numpy as np
import pytest

from macromicro.control.terminal.adapting import LEAST, adapt
from macromicro.control.terminal.model import Terminal

P = Terminal(coulomb=2.0)


def run(friction, speed):
    return {"friction": np.asarray(friction, float), "speed": np.asarray(speed, float)}


def test_the_median_of_what_was_found_in_motion_is_added_and_nothing_else_changes():
    friction = [0.3] * LEAST + [0.5] * (LEAST - 1) + [9.0] * 500
    speed = [20.0] * LEAST + [-20.0] * (LEAST - 1) + [0.0] * 500
    assert adapt(P, run(friction, speed)) == P._replace(coulomb=2.3)


@pytest.mark.parametrize(("moving", "coulomb"), [(LEAST - 1, 2.0), (LEAST, 1.6)])
def test_too_little_motion_tells_nothing(moving, coulomb):
    found = adapt(P, run([-0.4] * 100, [1.0] * moving + [0.0] * (100 - moving)))
    assert found.coulomb == pytest.approx(coulomb)


def test_friction_is_never_below_none():
    assert adapt(P, run([-2.5] * LEAST, [5.0] * LEAST)).coulomb == 0.0
