"""An actuator from drive and position alone, on a wire that the model is not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import search, wire
from macromicro.identify.wire import Heated
from macromicro.identify.wire_model import simulate

DT = 0.02


def foreign(u: Array, seed: int) -> Heated:
    """A wire against a spring, A and mm: Joule heat that grows with the resistance, convection that
    grows with the temperature, a mount that warms, and a share of martensite by cosine laws
    (Liang and Rogers, 1990) whose temperatures rise with the spring's force."""
    random = np.random.default_rng(seed)
    wire = mount = 0.0
    xi, start, way = 1.0, 1.0, 0.0
    warming = True
    x = np.empty(len(u))
    for k, drive in enumerate(u):
        x[k] = way
        before = wire - 9.0 * way
        power = drive * drive * (1.0 + 0.15 * xi) * 45.0
        loss = (1.0 + 2e-3 * wire) * (wire - mount)
        wire += DT * (power - loss) / 0.9
        mount += DT * (0.12 * (wire - mount) - 0.05 * mount) / 8.0
        now = wire - 9.0 * way
        if (now > before) != warming:
            warming, start = now > before, xi
        had = xi
        if warming:
            at = min(max((now - 50.0) / 14.0, 0.0), 1.0)
            xi = min(xi, start * 0.5 * (math.cos(math.pi * at) + 1.0))
        else:
            at = min(max((44.0 - now) / 16.0, 0.0), 1.0)
            grown = start + (1.0 - start) * 0.5 * (1.0 - math.cos(math.pi * at))
            xi = max(xi, grown)
        wire -= 5.0 * (had - xi)  # latent heat
        way = 2.4 * (1.0 - xi) - 4e-4 * wire
    return Heated(u, x + 1e-3 * random.standard_normal(len(x)), DT)


def levels(seed: int, n: int = 6000) -> Array:
    """Steps of the drive, each for 3 to 12 s, with rests."""
    random = np.random.default_rng(seed)
    parts: list[Array] = []
    while sum(map(len, parts)) < n:
        level = random.choice([0.0, 0.0, 0.5, 0.8, 1.0, 1.1, 1.2, 1.3, 1.6])
        parts.append(np.full(int(random.integers(100, 350)), level))
    return np.concatenate([np.zeros(20), *parts])[:n]


@pytest.mark.slow
def test_two_records_foretell_others_that_were_not_fitted() -> None:
    """The table of docs/validation/identification.md: four pairs, eight others by each.

    Where cooling follows upon a short warming the cosine law transforms anew, its inner loops do
    not close; record 15 has such, and is all that is missed by more than 2 %.
    """
    others = {seed: foreign(levels(seed), seed) for seed in range(9, 17)}
    missed = np.empty((4, len(others)))
    for row, first in zip(missed, (1, 3, 5, 7), strict=True):
        records = [foreign(levels(s), s) for s in (first, first + 1)]
        extent = np.ptp(np.concatenate([r.x for r in records]))
        fit = wire.without_table(records)
        assert fit.rms < 0.013 * extent
        assert np.all(np.diff(fit.model.wires.heat) > 0.0)
        for k, other in enumerate(others.values()):
            made = simulate(fit.model, other.u, DT)
            row[k] = np.sqrt(np.mean((made - other.x) ** 2)) / np.ptp(other.x)
    assert np.median(missed) < 0.012 and missed.max() < 0.029
    kept = [k for k, seed in enumerate(others) if seed != 15]
    assert missed[:, kept].max() < 0.02


def own(known: wire._Scale, **changes: float) -> tuple[Array, list[str]]:
    """Search values of a known actuator."""
    return wire.search_values(known.parameters, changes), [p.name for p in known.parameters]


def test_what_the_model_made_is_found_again() -> None:
    u = levels(5, 4000)
    known = wire._Scale(wire._nodes(u), 25.0, 80.0, 2.0, 0.1)
    z, _ = own(known, wire=0.8, latent=10.0, stroke=1.2, hysteresis=15.0, warm=90.0)
    model, table, values = wire._wire(known, z)
    x = simulate(model, u, DT)
    assert x[0] == pytest.approx(0.1, abs=1e-3)
    assert model.wires.ladder.c1 * model.wires.ladder.r1 == pytest.approx(0.8)
    assert sum(model.wires.ladder[k] for k in (1, 3, 5)) == pytest.approx(1.0)
    assert table.span == pytest.approx(2.4)
    assert values["heat 1.6"] == pytest.approx(90.0)
    assert values["heat 0.5"] == pytest.approx(90.0 * (0.5 / 1.6) ** 2)
    grid = wire._grid(Heated(u, x, DT))
    assert np.abs(wire._errors(known, [grid], z)).max() < 1e-12
    slopes = search.slopes(
        lambda z: wire._errors(known, [grid], z), z, wire.bounds_of(known.parameters)
    )
    assert np.all(np.abs(slopes).max(axis=0)[[0, 5, 10, 14]] > 1e-3)


def test_medians_of_contraction_and_extension_are_where_they_are_said_to_be() -> None:
    known = wire._Scale(np.array([0.0, 1.0]), 25.0, 80.0, 2.0, 0.0)
    spreads = {"rise spread": 1.5, "fall spread": 1.5}
    z, _ = own(known, **{"rise skew": 0.4, "fall skew": 3.0, "hysteresis": 35.0}, **spreads)
    _, table, _ = wire._wire(known, z)
    at = table.lo + table.step * np.arange(len(table.values))
    rise = table.values[:, 0] / table.span
    fall = 1.0 - table.values[-1, :] / table.span
    assert np.interp(0.5, rise, at) == pytest.approx(80.0, abs=0.1)
    assert np.interp(0.5, fall, at) == pytest.approx(45.0, abs=0.1)


def test_twice_the_scale_of_temperature_is_the_same_actuator() -> None:
    u = levels(6, 3000)
    made = []
    for austenite, size in ((80.0, 1.0), (135.0, 2.0)):
        known = wire._Scale(wire._nodes(u), 25.0, austenite, 2.0, 0.0)
        z, _ = own(
            known,
            **{n: size * v for n, v in (
                ("latent", 15.0), ("stiffening", 1.0), ("rise spread", 4.0), ("hysteresis", 20.0),
                ("fall spread", 4.0), ("warm", 90.0),
            )},
            resistance=-0.1,
            growth=0.3,
        )  # fmt: skip
        made.append(simulate(wire._wire(known, z)[0], u, DT))
    assert made[0] == pytest.approx(made[1], abs=1e-6)


def test_expansion_makes_the_wires_longer_while_they_warm() -> None:
    u = np.full(500, 0.5)
    known = wire._Scale(np.array([0.0, 0.5]), 25.0, 80.0, 2.0, 0.0)
    z, names = own(known, expansion=0.05, warm=20.0)
    x = simulate(wire._wire(known, z)[0], u, DT)
    z[names.index("expansion")] = 0.0
    plain = simulate(wire._wire(known, z)[0], u, DT)
    assert x[-1] < plain[-1] - 0.05 * 2.0 * 10.0 / 55.0


def steady(**changes: float) -> tuple[float, float]:
    """Warming of contracted wires in the end, which their expansion shows, and the heat, K."""
    known = wire._Scale(np.array([0.0, 1.0]), 25.0, 80.0, 2.0, 0.0)
    always = {"expansion": 0.05, "r1": 0.6, "plates": 1.0, "body": 5.0, "warm": 200.0}
    z, _ = own(known, **always, **changes)
    p, _, values = wire._wire(known, z)
    x = simulate(p, np.full(6000, 1.0), DT)
    return float((2.0 - x[-1]) / p.expansion), values["heat 1"]


def test_heat_changes_with_the_resistance_of_what_is_transformed() -> None:
    plain, heat = steady()
    assert plain == pytest.approx(heat, rel=1e-3)
    assert steady(resistance=-0.15)[0] == pytest.approx(0.85 * heat, rel=1e-3)


def test_hot_wires_lose_more_where_convection_grows() -> None:
    """(T - plates) (1 + g T) = r1 heat, the plates at (1 - r1) heat."""
    warm, heat = steady(growth=0.22)
    assert (warm - 0.4 * heat) * (1.0 + 0.22 / 55.0 * warm) == pytest.approx(0.6 * heat, rel=1e-3)


def test_many_levels_get_few_points_and_few_levels_one_each() -> None:
    assert list(wire._nodes(np.array([0.0, 1.0, 1.0, 2.5]))) == [0.0, 1.0, 2.5]
    many = wire._nodes(np.linspace(-1.0, 3.0, 400))
    assert len(many) == 8 and many[0] == 0.0 and many[-1] == 3.0


@pytest.mark.parametrize(
    ("records", "options", "said"),
    [
        ([], {}, "one or more, each from cold"),
        ([Heated(np.ones(60), np.zeros(60), DT)], {}, "the position is constant"),
        ([Heated(-np.ones(60), np.arange(60.0), DT)], {}, "never above 0"),
        ([Heated(np.ones(60), np.arange(60.0), DT)], {"austenite": 20.0}, "austenite.*above"),
    ],
)
def test_what_cannot_be_is_refused(records: list[Heated], options: dict, said: str) -> None:
    with pytest.raises(InputError, match=said):
        wire.without_table(records, **options)
