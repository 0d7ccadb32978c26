"""Costs, Tables 2.1, 6.1 and 6.2."""

from __future__ import annotations

import pytest

from macromicro.design import costs
from macromicro.design.costs import Technology
from macromicro.errors import InputError


def test_micro_stage() -> None:
    """Claim D9, Table 6.1."""
    assert costs.total(costs.MICRO_STAGE) == 255.0


def test_comparison() -> None:
    """Table 6.2: the DC motor costs 5.9 times as much and is at least five times finer."""
    first, *_, last = costs.compare(costs.micro_stage(), costs.TABLE_6_2)
    assert first.cheapest == first.dearest == pytest.approx(1500 / 255)
    assert first.accuracy == pytest.approx(0.2)
    assert last.accuracy == pytest.approx(20e-9 / 5e-6)


def test_tables_agree_but_for_two_prices() -> None:
    """Table 2.1 prints 3000 for the ultrasonic drive and a range for the DC motor."""
    pairs = zip(costs.TABLE_2_1, costs.TABLE_6_2, strict=True)
    apart = {a.name for a, b in pairs if a.cost != b.cost}
    assert apart == {"miniature DC motor, lead screw and nut", "ultrasonic piezo drive"}
    pairs = zip(costs.TABLE_2_1, costs.TABLE_6_2, strict=True)
    assert all(a.accuracy == pytest.approx(b.accuracy) for a, b in pairs)


@pytest.mark.parametrize("parts", [{}, {"x": 0.0}, {"x": -1.0}, {"x": float("nan")}])
def test_bad_parts_are_refused(parts: dict[str, float]) -> None:
    with pytest.raises(InputError, match="costs"):
        costs.total(parts)


@pytest.mark.parametrize(
    "bad",
    [
        Technology("x", (0.0, 1e-6), (0.0, 0.0)),
        Technology("x", (2e-6, 1e-6), (1.0, 1.0)),
        Technology("x", (0.0, 0.0), (1.0, 1.0)),
    ],
)
def test_bad_technologies_are_refused(bad: Technology) -> None:
    with pytest.raises(InputError, match="x, "):
        costs.compare(costs.micro_stage(), [bad])


@pytest.mark.parametrize("accuracy", [0.0, -1.0, float("nan"), True, "5 um"])
def test_an_accuracy_is_above_nothing(accuracy: float) -> None:
    with pytest.raises(InputError, match="SMA micro-stage, accuracy"):
        costs.micro_stage(accuracy)


def test_both_ends_of_the_others_costs_are_compared_with_our_greatest() -> None:
    """And their coarsest accuracy with ours."""
    own = Technology("own", (1e-6, 5e-6), (100.0, 200.0))
    other = Technology("other", (2e-6, 20e-6), (600.0, 3000.0))
    (found,) = costs.compare(own, [other])
    assert found == ("other", 3.0, 15.0, pytest.approx(4.0))
