"""The micro-stage's return to zero and the laser's bias (Section 6.3, Figure 6.4)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.control.supervisor import DONE, MACRO, MICRO
from macromicro.design.extension import extension, per_cycle
from macromicro.design.response import moves
from macromicro.programme import Programme
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording

DT, ON, OFF = 1e-3, 1000, 3000


def cycled(*time_constants: float, floor: float = 0.0) -> tuple[Recording, Programme]:
    """Cycles of a macro and a micro move to 0.3 mm. Disabled, the stage returns with a time
    constant [s] towards `floor` [um]; the laser is reset when it is enabled."""
    n = len(time_constants)
    laps = []
    left = 0.0
    for tau in (0.0, *time_constants):
        back = (
            floor + (300.0 - floor) * np.exp(-np.arange(OFF) * DT / tau) if tau else np.zeros(OFF)
        )
        fine = np.full(ON, 300.0)
        laps.append((np.concatenate((back, fine)), np.concatenate((back, fine - left))))
        left = float(back[-1])
        laps[-1][1][OFF:] = 300.0 - left
    hall, laser = (np.concatenate(x) for x in zip(*laps, strict=True))
    rows = len(hall)
    lap = np.repeat([0, 1], [OFF, ON])
    arrays = {c.name: np.zeros(rows) for c in COLUMNS}
    arrays["t"] = np.arange(rows) * DT
    arrays["move"] = np.concatenate([lap + 2 * k for k in range(n + 1)])
    arrays["phase"] = np.tile(np.where(lap == 0, MACRO, MICRO), n + 1)
    arrays["phase"][-1] = DONE
    arrays["hall_position"], arrays["laser"] = hall * 1e-3, laser
    arrays["true_micro"] = arrays["hall_position"]
    made = Recording.from_arrays(COLUMNS, [arrays[c.name] for c in COLUMNS], DT, {})
    size = 2 * (n + 1)
    plan = Programme(
        "",
        np.full(size, math.nan),
        np.tile([0, 1], n + 1),
        np.tile([0.0, 0.3e-3], n + 1),
        np.zeros(size),
        math.nan,
        "",
    )
    return made, plan


def test_time_to_within_20_um() -> None:
    """An exponential from 300 um is within 20 um after tau ln(15)."""
    made, _ = cycled(0.4)
    (found,) = extension(made)
    assert found.time_s == pytest.approx(0.4 * math.log(15.0), abs=0.002)
    assert found.from_um == pytest.approx(300.0)
    assert found.start_s == pytest.approx((OFF + ON) * DT)
    assert found.move == 1


def test_a_return_that_hangs_is_none() -> None:
    made, plan = cycled(0.3, floor=25.0)
    (found,) = extension(made)
    assert found.time_s is None and found.left_um == pytest.approx(25.0, abs=0.1)
    assert per_cycle(moves(made, plan), [found], 2)[0].extension_s is None


def test_what_is_left_at_the_reset_is_the_bias() -> None:
    """I3: the bias is an artefact of resetting the laser before full extension."""
    made, plan = cycled(0.3, 0.9, floor=0.0)
    found = per_cycle(moves(made, plan), extension(made), 2)
    assert [c.cycle for c in found] == [1, 2, 3]
    first, second, third = found
    assert first.extension_s is not None and second.extension_s is not None
    assert second.extension_s == pytest.approx(3 * first.extension_s, rel=0.01)
    assert third.returns == 0 and third.extension_s is None
    assert third.bias_um == pytest.approx(second.left_um, rel=0.05)
    assert third.true_bias_um == pytest.approx(0.0, abs=1e-9)


def test_a_programme_without_micro_moves_has_no_returns() -> None:
    """The full travel of the macro-stage alone."""
    arrays = [np.ones(500) if c.name == "phase" else np.zeros(500) for c in COLUMNS]
    assert extension(Recording.from_arrays(COLUMNS, arrays, DT, {})) == []


def test_a_stage_that_never_moved_does_not_return() -> None:
    made, _ = cycled()
    assert extension(made) == []


def test_a_stage_that_keeps_its_set_point_does_not_return() -> None:
    """With `sequence.overlap` it stays under control while the carriage moves."""
    made, _ = cycled(0.2, 0.3)
    assert len(extension(made)) == 2
    arrays = [np.array(made[c.name]) for c in made.columns]
    at = [c.name for c in made.columns].index("micro_reference")
    arrays[at] = np.where(made["phase"] == MACRO, 0.3, arrays[at])
    held = Recording.from_arrays(made.columns, arrays, made.dt, {})
    assert extension(held) == []
