"""The textbook's law of stress and strain (Figure 2.9)."""

from __future__ import annotations

import pytest

from macromicro.thesis.chapter2._actuator_runs import Alloy, detwinned_share, strain

P = Alloy()


def test_pieces_meet() -> None:
    """Elastic, plateau, elastic: no jump at the plateau's ends."""
    for edge in (P.plateau_start, P.plateau_end):
        below, above = (
            strain(P, s, 0.0, detwinned_share(P, s, 0.0)) for s in (edge - 1.0, edge + 1.0)
        )
        assert above - below == pytest.approx(0.0, abs=1e-8)
    beyond = P.plateau_end + 28e6
    grown = strain(P, beyond, 0.0, 1.0) - strain(P, P.plateau_end, 0.0, 1.0)
    assert grown == pytest.approx(28e6 / P.martensite)


def test_twins_do_not_come_back() -> None:
    assert detwinned_share(P, P.plateau_end, 0.0) == 1.0
    assert detwinned_share(P, 0.0, 0.7) == 0.7
    assert detwinned_share(P, 0.5 * (P.plateau_start + P.plateau_end), 0.2) == pytest.approx(0.5)


def test_austenite_takes_the_strain_back() -> None:
    assert strain(P, 0.0, 1.0, 1.0) == 0.0
    assert strain(P, 75e6, 1.0, 1.0) == pytest.approx(1e-3)
    half = strain(P, 0.0, 0.5, 1.0)
    assert half == pytest.approx(0.5 * P.plateau_strain)


@pytest.mark.parametrize("stress", [141e6, 500e6, 1e9])
def test_beyond_the_plateau_no_more_strain_comes_out(stress: float) -> None:
    assert detwinned_share(P, stress, 0.0) == 1.0


@pytest.mark.parametrize("stress", [69e6, 0.0, -200e6])
def test_below_the_plateau_none_does(stress: float) -> None:
    assert detwinned_share(P, stress, 0.0) == 0.0
