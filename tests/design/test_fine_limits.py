"""The quickest way of the micro-stage: full heat and none, and nothing is quicker."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.arrays import own
from macromicro.design import fine_limits
from macromicro.errors import InputError
from macromicro.plant import bench
from macromicro.plant.bench import Noise
from macromicro.settings import Settings
from macromicro.types import Outputs

S = Settings()
PLANT = bench.prepare(S.bench, S.sensors)


def driven(state: bench.State, ctrl: list[float]) -> bench.State:
    state = own(state)
    for volts in ctrl:
        state = bench.advance(PLANT, state, Outputs(0.0, volts, 0.0, 0.0), Noise(), 1e-3)
    return state


def test_the_time_is_that_of_full_heat_and_the_state_stays() -> None:
    cold = bench.initial(PLANT)
    corners = cold.micro.wire.memory.corners.copy()
    found = fine_limits.quickest(PLANT, cold, 0.5e-3)
    n = round(found / 1e-3)
    assert 0.05 < found < 1.0
    assert driven(cold, [5.0] * n).micro.wire.x >= 0.49e-3
    assert driven(cold, [5.0] * (n - 1)).micro.wire.x < 0.49e-3
    assert np.array_equal(cold.micro.wire.memory.corners, corners)


def test_the_way_back_is_that_without_heat() -> None:
    warm = driven(bench.initial(PLANT), [5.0] * 330)
    assert warm.micro.wire.x > 0.55e-3
    found = fine_limits.quickest(PLANT, warm, 0.5e-3)
    n = round(found / 1e-3)
    assert driven(warm, [0.0] * n).micro.wire.x <= 0.51e-3
    assert driven(warm, [0.0] * (n - 1)).micro.wire.x > 0.51e-3
    assert driven(warm, [1.3] * n).micro.wire.x > 0.5e-3


def test_near_is_near_already() -> None:
    assert fine_limits.quickest(PLANT, bench.initial(PLANT), 5e-6) == 0.0


def test_what_it_does_not_reach_is_told() -> None:
    with pytest.raises(InputError, match="9 mm"):
        fine_limits.quickest(PLANT, bench.initial(PLANT), 9e-3)


def test_turns_begin_cold_and_go_on_from_where_they_were_held() -> None:
    first, second, back = fine_limits.turns(S.bench, S.sensors, [0.5e-3, 1e-3, 0.5e-3], hold=1.0)
    cold = bench.initial(PLANT)
    assert (first.start, first.place) == (0.0, 0.5e-3)
    assert first.time == fine_limits.quickest(PLANT, cold, 0.5e-3)
    assert second.start == pytest.approx(0.5e-3, abs=5e-6)
    assert second.time < fine_limits.quickest(PLANT, cold, 1e-3) - 0.05  # it is warm
    assert back.start == pytest.approx(1e-3, abs=5e-6) and back.time > 0.05
    with pytest.raises(InputError, match=r"-1 mm.*a contraction of 0 mm or more"):
        fine_limits.turns(S.bench, S.sensors, [-1e-3])
