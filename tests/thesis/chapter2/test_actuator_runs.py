"""Section 2.3 tried out: work of a cycle, hysteresis, the law's curves."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.plant.bench import Bench
from macromicro.thesis.chapter2 import _actuator_runs
from macromicro.thesis.chapter2._actuator_runs import Alloy, Principle, law_cycle, load_and_unload


@pytest.fixture(scope="module")
def data() -> Principle:
    return _actuator_runs.collect(Bench())


def test_area_is_the_work_of_lifting(data: Principle) -> None:
    """Section 2.3.2: for the bench's stiff wires nearly the load times its way; not for a
    wire whose plateau lies between the loads."""
    cycle = data.bench_cycle
    assert cycle.area == pytest.approx(cycle.lifting, rel=0.01)
    assert cycle.area < cycle.lifting
    law = law_cycle(Alloy())
    assert law.area < 0.9 * law.lifting


def test_laws_area_by_hand() -> None:
    """A trapezoid's sides, worked out apart: lifted stress times strain A-B, less a triangle of
    elastic unloading, less what lies left of the loading curve D-A."""
    p, high, low = Alloy(), _actuator_runs.LAW_HIGH, _actuator_runs.BIAS
    place = {
        "A": high / p.martensite + p.plateau_strain,
        "B": high / p.austenite,
        "C": low / p.austenite,
        "D": low / p.martensite
        + p.plateau_strain * (low - p.plateau_start) / (p.plateau_end - p.plateau_start),
        "end": p.plateau_end / p.martensite + p.plateau_strain,
    }
    right = 0.5 * (place["D"] + place["end"]) * (p.plateau_end - low)
    right += 0.5 * (place["end"] + place["A"]) * (high - p.plateau_end)
    left = 0.5 * (place["B"] + place["C"]) * (high - low)
    law = law_cycle(p, each=2000)
    assert law.area == pytest.approx(right - left, rel=1e-5)
    assert law.lifting == pytest.approx((high - low) * (place["A"] - place["B"]))


def test_hysteresis(data: Principle) -> None:
    """Figure 2.8: A_s < A_f, M_f < M_s, and martensite forms colder than it vanished."""
    up, down = data.turnings
    assert up.start < up.finish and down.finish < down.start
    assert down.finish < up.start and down.start < up.finish


def test_minor_loops_stay_inside_the_major_one(data: Principle) -> None:
    t, x = data.major.temperature, data.major.extension
    half = len(t) // 2
    upper = np.interp(data.minor.temperature, t[: half + 1], x[: half + 1])
    lower = np.interp(data.minor.temperature, t[half:][::-1], x[half:][::-1])
    assert np.all(data.minor.extension <= upper + 5e-5)
    assert np.all(data.minor.extension >= lower - 5e-5)
    inside = (data.minor.extension < upper - 1e-4) & (data.minor.extension > lower + 1e-4)
    assert inside.any()


def test_pull_returns_on_itself(data: Principle) -> None:
    """Figure 2.9 (c)."""
    for r in data.pulled:
        each = (len(r.load) - 1) // 3
        assert r.extension[-1] == pytest.approx(r.extension[each], abs=1e-9)
        assert r.extension[2 * each] > r.extension[each]


def test_plateau_is_kept_on_unloading() -> None:
    """Figure 2.9a: half-way along the plateau half of its strain stays; none in austenite."""
    alloy = Alloy()
    middle = 0.5 * (alloy.plateau_start + alloy.plateau_end)
    assert load_and_unload(alloy, 0.0, middle).strain[-1] == pytest.approx(
        0.5 * alloy.plateau_strain
    )
    assert load_and_unload(alloy, 1.0, middle).strain[-1] == 0.0
    assert load_and_unload(alloy, 0.0, 0.99 * alloy.plateau_start).strain[-1] == 0.0
