"""The alloy wires: Sections 2.3, 5.2; literature values of NiTi."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from macromicro.plant import micro, wire
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.plant.wire import Load, Wire

from .drives import MICRO, tempered

P = MICRO.wire
LOAD = MICRO.load
TABLE = MICRO.table
CAPACITY = MICRO.thermal.wire_capacity
LATENT = P.latent / CAPACITY
gains = st.lists(st.floats(-0.05, 0.15), min_size=1, max_size=60)


def fresh(load: Load = LOAD) -> wire.WireState:
    """Cold wires."""
    return micro.cold_wire(P, load, TABLE, 25.0)


@given(gains, st.floats(-0.2, 0.2))
@settings(max_examples=50)
def test_contraction_stays_within_0_and_the_stop(steps: list[float], inertia: float) -> None:
    """Section 5.2.2 (S3): whatever heat comes and goes, 0 to 3.98 mm at rest."""
    s = fresh()
    for gain in steps:
        s = wire.heated(P, LOAD, TABLE, s, gain, 0.0, CAPACITY)
        assert -1e-9 <= s.x <= 3.98e-3
        assert 0.0 <= s.austenite <= 1.0
    x, _ = wire.geometry(P, LOAD, s.austenite, inertia)
    assert x <= 3.98e-3  # and no acceleration pulls it past the stop


@given(gains)
@settings(max_examples=50)
def test_heat_taken_is_heat_held(steps: list[float]) -> None:
    """Energy balance, latent heat included: capacity dT + latent dxi = what came in."""
    s = fresh()
    for gain in steps:
        s = wire.heated(P, LOAD, TABLE, s, gain, 0.0, CAPACITY)
    held = CAPACITY * (s.temperature - 25.0) + P.latent * s.austenite
    total = sum(abs(gain) for gain in steps)
    assert abs(held - sum(steps)) <= 1e-6 * total + 1e-12


@given(gains, st.floats(-0.02, 0.02), st.floats(-0.2, 0.2))
@settings(max_examples=50)
def test_solve_finds_the_balance_in_a_few_evaluations(
    steps: list[float], gain: float, inertia: float
) -> None:
    """The relays' input that belongs to the heat content: residual under 1e-9 K."""
    s = fresh()
    for step in steps:
        s = wire.heated(P, LOAD, TABLE, s, step, 0.0, CAPACITY)
    content = s.content + gain / CAPACITY
    u, slope = wire.solve(P, LOAD, TABLE, s, content, inertia, LATENT)
    residual = wire._excess(P, LOAD, TABLE, s.memory, u, inertia, LATENT) - content
    assert abs(residual) < 1e-9
    assert slope >= 1.0


@given(gains)
@example([0.125, 0.125, 0.0625, 0.09375, 0.109375, 0.015625, -0.03125, 0.09375, -0.013671875])
@settings(max_examples=25)
def test_solve_is_quick(steps: list[float]) -> None:
    """A period's heat (at most 1.5 mJ) takes four evaluations on average.

    Some 20 where the wires run against the stop, which is a kink; never all 60 allowed.
    """
    calls = 0
    original = wire._excess

    def counted(*args: object) -> float:
        nonlocal calls
        calls += 1
        return original(*args)  # type: ignore[arg-type]

    s = fresh()
    for step in steps:
        s = wire.heated(P, LOAD, TABLE, s, step, 0.0, CAPACITY)
    worst, done = 0, 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wire, "_excess", counted)
        for k in range(60):
            before = calls
            s = wire.heated(
                P, LOAD, TABLE, s, 1.4e-3 * (1.0 if k % 20 < 12 else -0.5), 0.0, CAPACITY
            )
            worst, done = max(worst, calls - before), done + 1
    assert worst <= 40
    assert calls / done <= 4.0


@pytest.mark.parametrize("grams", [0.0, 30.0, 60.0])
def test_load_raises_the_transformation_temperature(grams: float) -> None:
    """Clausius-Clapeyron, 6.5-10 MPa/K: every gram shifts all thresholds up alike."""
    load = Load(grams * GRAM_FORCE, 0.0, 0.0)
    s = micro.cold_wire(P, load, TABLE, 25.0)
    path = np.linspace(25.0, 119.0, 3761)
    half = None
    for t in path:
        s = wire.tempered(P, load, TABLE, s, float(t))
        if half is None and s.austenite >= 0.5:
            half = float(t)
    reference = path[np.argmax(_kiln_austenite(path) >= 0.5)]
    assert half is not None
    assert half - reference == pytest.approx(0.085 * (grams - 30.0), abs=0.06)


def _kiln_austenite(path: np.ndarray) -> np.ndarray:
    """Austenite on heating at the reference load."""
    load = Load(P.reference_load, 0.0, 0.0)
    s, found = micro.cold_wire(P, load, TABLE, 25.0), []
    for t in path:
        s = wire.tempered(P, load, TABLE, s, float(t))
        found.append(s.austenite)
    return np.array(found)


def test_literature_values_are_kept() -> None:
    """NiTi: 6450 kg/m3, 450-840 J/kg/K, 12-24 kJ/kg, 6.5-10 MPa/K, 28-41 and 75-83 GPa, 4 %."""
    mass = 6450.0 * P.length * P.area
    assert 450.0 <= CAPACITY / mass <= 840.0
    assert 12e3 <= P.latent / mass <= 24e3
    assert 6.5e6 <= 1.0 / (P.shift * P.area) <= 10e6
    assert 28e9 <= P.martensite <= 41e9
    assert 75e9 <= P.austenite <= 83e9
    assert P.stroke / P.length == pytest.approx(0.04, rel=0.05)


@given(st.floats(0.0, 0.9), st.floats(0.0, 0.5))
def test_a_load_stretches_the_wires(austenite: float, extra: float) -> None:
    """Elastic strain: more load, less contraction; and austenite stretches less."""
    x0, f0 = wire.geometry(P, LOAD, austenite, 0.0)
    x1, f1 = wire.geometry(P, LOAD, austenite, extra)
    assert x1 <= x0
    assert f1 >= f0 - 1e-12
    soft = wire.geometry(P, LOAD, 0.0, 0.2)[0]
    hard = wire.geometry(P, LOAD, 0.9, 0.2)[0] - wire.geometry(P, LOAD, 0.9, 0.0)[0]
    assert soft < hard < 0.0


@given(st.floats(0.0, 1.0), st.floats(-0.2, 0.2))
def test_force_and_length_are_in_balance(austenite: float, inertia: float) -> None:
    """Below the stop the wires carry preload, springs and inertia; their stretch is Hooke's."""
    x, force = wire.geometry(P, LOAD, austenite, inertia)
    if x < P.stop:
        assert force == pytest.approx(LOAD.preload + LOAD.rate * x + inertia)
    modulus = 1.0 / ((1.0 - austenite) / P.martensite + austenite / P.austenite)
    stretch = force * P.length / (modulus * P.area)
    cold = LOAD.preload * P.length / (P.martensite * P.area)
    assert x == pytest.approx(P.stroke * austenite + cold - stretch, abs=1e-12)


def test_force_is_continuous_at_the_stop() -> None:
    """At the stop the wires go on pulling: their force never falls with more austenite."""
    share = np.linspace(0.95, 1.0, 2001)
    found = np.array([wire.geometry(P, LOAD, float(a), 0.0) for a in share])
    assert np.all(np.diff(found[:, 0]) >= 0.0)
    assert np.all(np.diff(found[:, 1]) >= -1e-9)
    assert np.diff(found[:, 1]).max() < 0.05
    assert found[-1, 0] == P.stop


@pytest.mark.parametrize("turn", [60.0, 80.0, 95.0])
def test_minor_loops_in_temperature_are_wiped_out(turn: float) -> None:
    """Section 2.4.1, Figure 5.9: a loop inside a rise leaves the rise as it was."""
    plain = tempered(np.r_[np.linspace(25.0, 110.0, 851)])
    looped = tempered(
        np.r_[
            np.linspace(25.0, turn, 300),
            np.linspace(turn, 45.0, 300),
            np.linspace(45.0, turn, 300),
            np.linspace(turn, 110.0, 300),
        ]
    )
    at_turn = np.interp(turn, np.linspace(25.0, 110.0, 851), plain)
    assert looped[299] == pytest.approx(at_turn, abs=2e-6)
    assert looped[899] == pytest.approx(looped[299], abs=1e-9)
    assert looped[-1] == pytest.approx(plain[-1], abs=1e-9)
    assert np.abs(np.diff(looped)).max() > 0.0


def test_wires_given_no_heat_stay_as_they_are() -> None:
    s = fresh()
    again = wire.heated(P, LOAD, TABLE, s, 0.0, 0.0, CAPACITY)
    assert (again.u, again.temperature) == (s.u, s.temperature)
    assert again.x == pytest.approx(0.0, abs=1e-12)
    assert Wire().reference_load == pytest.approx(30.0 * GRAM_FORCE)


@given(gains, st.floats(-0.2, 0.2))
@settings(max_examples=30)
def test_the_relays_see_the_temperature_less_the_loads_shift(
    steps: list[float], inertia: float
) -> None:
    """Clausius-Clapeyron: u = T - shift (F - F_ref), with the force of the present contraction."""
    s = fresh()
    for gain in steps:
        s = wire.heated(P, LOAD, TABLE, s, gain, inertia, CAPACITY)
    _, force = wire.geometry(P, LOAD, s.austenite, inertia)
    assert s.u == pytest.approx(s.temperature - P.shift * (force - P.reference_load), abs=1e-8)
