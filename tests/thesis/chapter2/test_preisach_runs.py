"""Section 2.4.1 step by step: the model's outputs against relays and integrals."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import dblquad

from macromicro.thesis.chapter2 import preisach_geometry
from macromicro.thesis.chapter2.preisach_geometry import FURTHER, INPUTS, Geometry


@pytest.fixture(scope="module")
def data() -> Geometry:
    return preisach_geometry.geometry()


def test_weight_is_the_integral_of_the_density() -> None:
    for alpha, beta in ((1.0, -1.0), (0.4, -0.5), (0.1, -0.9)):
        whole, _ = dblquad(
            lambda b, a: float(preisach_geometry.density(np.array(a), np.array(b))),
            beta,
            alpha,
            beta,
            lambda a: a,
        )
        assert preisach_geometry.weight(alpha, beta) == pytest.approx(whole, rel=1e-8)


def test_outputs_are_those_of_single_relays(data: Geometry) -> None:
    """(2.2): relays of -1 and 1, each by itself, through the same inputs."""
    u = np.arange(-1.0, 1.0, 0.005) + 0.0025
    alpha, beta = np.meshgrid(u, u, indexing="ij")
    weights = np.where(alpha > beta, preisach_geometry.density(alpha, beta), 0.0)
    weights /= weights.sum()
    on = np.zeros(alpha.shape, dtype=bool)
    for value, stage in zip((-1.0, *INPUTS, *FURTHER), data.stages, strict=True):
        on = (on | (alpha <= value)) & ~(beta > value)
        assert stage.u == value
        assert stage.f == pytest.approx(2.0 * weights[on].sum() - 1.0, abs=0.01)


def test_stairs_have_their_corners_at_the_turns(data: Geometry) -> None:
    """Figures 2.13-2.16."""
    u1, u2, u3, u4 = INPUTS
    first, second, third, fourth = data.stages[1:5]
    assert np.all(first.alpha == u1)
    assert (second.beta[-1], second.alpha[-1]) == (u2, u1)
    assert (third.beta[1], third.alpha[1]) == (u2, u1) and third.alpha[-1] == u3
    assert (fourth.beta[-1], fourth.alpha[-1]) == (u4, u3)


def test_trapezoids_by_both_ways(data: Geometry) -> None:
    """(2.7), (2.9), (2.10): off by the grid's error only; (2.11) is the model's output."""
    assert [(q.top, q.low) for q in data.trapezoids] == [(0.7, -0.5), (0.4, -0.1), (0.25, 0.1)]
    for q in data.trapezoids:
        assert q.difference == pytest.approx(q.integrated, rel=1e-3)
    assert data.output == pytest.approx(data.stages[-1].f, abs=1e-12)


def test_first_order_curve(data: Geometry) -> None:
    """(2.8), Figure 2.19: from the ascending branch down to beta'."""
    first, second, integrated = data.corner
    u, rising, _ = data.major
    assert first == pytest.approx(np.interp(preisach_geometry.FOD[0], u, rising))
    assert 0.5 * (first - second) == pytest.approx(integrated, rel=1e-3)
    assert data.fod[1][0] == first
