"""Settings of the law `inverse`: tables from numbers, numbers from a fit, what cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.control.inverse import model
from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError
from macromicro.hysteresis import from_density
from macromicro.hysteresis.everett import lookup
from macromicro.schema import config

P = Inverse()


def test_thresholds_of_a_triangle() -> None:
    assert [model.nodes(k) for k in (0, 1, 2, 3, 6, 435, 436)] == [1, 2, 0, 3, 4, 30, 0]


def test_the_table_is_its_rows_below_the_diagonal() -> None:
    table = model.everett(P._replace(relays=(0.1, 0.4, 0.2), coldest=40.0, spacing=5.0))
    assert table[:3] == (40.0, 5.0, 3)
    assert table.values.tolist() == [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.4, 0.2, 0.0]]


def test_for_the_kernels_places_are_mm_and_the_resistances_make_one() -> None:
    made = model.prepare(P)
    m = made.model
    assert m.ladder.r1 + m.ladder.r2 + m.ladder.r3 == pytest.approx(1.0)
    assert m.stiffening == pytest.approx(1e-3 * P.stiffening)
    assert (m.cut_on, m.cut_off) == pytest.approx((1e3 * P.cut_on, 1e3 * P.cut_off))
    assert (m.hysteresis.low, m.hysteresis.span) == pytest.approx((1e3 * P.low, 1e3 * P.span))
    assert made.rise == pytest.approx(1e-3 * P.rise)
    assert (made.sensor, made.reach, made.quick, made.calm) == (P.sensor, P.reach, P.quick, P.calm)
    assert (made.settle, made.floor, made.step) == (P.settle, P.floor, P.step)


def test_a_fit_becomes_settings_and_back() -> None:
    fine = from_density(lambda up, down: np.exp(-((up - 80) ** 2 + (down - 65) ** 2) / 200), 30.0,
                        0.5, 181)  # fmt: skip
    fitted = model.prepare(P).model
    fitted = fitted._replace(hysteresis=fitted.hysteresis._replace(table=fine))
    found = model.gains(fitted, 2.5e-3, 0.02)
    assert found.sensor == 2.5e-3 and found.lag == P.lag and found.spacing <= 3.0
    again = model.prepare(found).model
    assert again.ladder == pytest.approx(fitted.ladder)
    assert again.stiffening == pytest.approx(fitted.stiffening)
    for up, down in ((75.0, 60.0), (90.0, 70.0), (84.0, 66.0)):
        coarse = lookup(again.hysteresis.table, up, down)
        assert coarse == pytest.approx(lookup(fine, up, down), abs=0.02)
    # At the coarse table's own thresholds nothing is lost but the fifth digit.
    t = again.hysteresis.table
    at = t.lo + t.step * 20, t.lo + t.step * 12
    assert lookup(t, *at) == pytest.approx(lookup(fine, *at), abs=1e-5)


def test_heat_that_seems_to_fall_is_held_level() -> None:
    fitted = model.prepare(P).model
    heat = fitted.heat.copy()
    heat[5] = heat[4] - 1.0
    found = model.gains(fitted._replace(heat=heat), 0.0, 0.02)
    assert found.heat[5] == found.heat[4] and found.problems() == []


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("heat", (0.0, 1.0), "as many as volts has"),
        ("volts", tuple(reversed(P.volts)), "values that rise"),
        ("heat", tuple(reversed(P.heat)), "values that rise"),
        ("r1", 0.9, "below 1 - r2"),
        ("cut_off", 1.0, "at most cut_on"),
        ("relays", (0.1, 0.2), r"n \(n - 1\) / 2"),
    ],
)
def test_what_cannot_be_an_actuators_is_told(key: str, value: object, said: str) -> None:
    wrong = P._replace(**{key: value})
    with pytest.raises(InputError, match=said):
        model.prepare(wrong)
    with pytest.raises(InputError, match=rf"a\.toml, controller\.fine\.{key}"):
        config.check(wrong, "a.toml", "controller.fine.")


def test_a_wrong_number_of_relays_makes_no_table() -> None:
    with pytest.raises(InputError, match=r"controller\.fine\.relays: there are 2 values"):
        model.everett(P._replace(relays=(0.1, 0.2)))


def test_the_shipped_ones_are_possible() -> None:
    assert P.problems() == []
