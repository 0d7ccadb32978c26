"""Margins and PD design, checked against closed formulas and the thesis' own controllers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.design.margins import (
    PdTaps,
    crossovers,
    damping_margin,
    first_crossover,
    is_stable,
    lowest_frequency,
    margins,
    open_loop,
    pd_by_margin,
    pd_by_time,
)
from macromicro.errors import InputError

NUM, DEN, DT = [0.16572], [1.0, -1.95833, 0.95833], 1e-3


@given(st.floats(0.1, 100.0))
def test_integrator(gain: float) -> None:
    """gain dt / (z - 1): |L| = 1 where 2 sin(w dt / 2) = gain dt, margin 90 deg - w dt / 2."""
    w = 2.0 / DT * math.asin(gain * DT / 2.0)
    found = first_crossover([gain * DT], [1.0, -1.0], DT)
    assert found.frequency == pytest.approx(w, rel=1e-8)
    assert found.phase_margin == pytest.approx(90.0 - math.degrees(w * DT / 2.0), abs=1e-6)


@pytest.mark.parametrize(
    ("taps", "frequency", "margin"),
    [
        (PdTaps(0.00245865, 0.0000998447), 9.91, 76.3),
        (PdTaps(0.0124593, -0.0112178), 4.91, 85.7),
        (PdTaps(0.0124593, 0.0112178), 56.6, 32.2),
    ],
)
def test_controllers_of_the_thesis(taps: PdTaps, frequency: float, margin: float) -> None:
    """Claims M11, M11b: (4.9); (4.10) with a minus and as printed, each with one crossover."""
    found = crossovers(*open_loop(taps, NUM, DEN), DT)
    assert len(found) == 1
    assert found[0].frequency == pytest.approx(frequency, rel=1e-3)
    assert found[0].phase_margin == pytest.approx(margin, abs=0.1)


def test_damping_margin() -> None:
    """wn^2 / (s (s + 2 r wn)) has this margin at its own crossover."""
    assert damping_margin(1.0) == pytest.approx(76.345, abs=1e-3)
    assert damping_margin(1.05) == pytest.approx(77.516, abs=1e-3)
    for ratio in (0.1, 0.5, 0.707, 2.0):
        w = math.sqrt(math.sqrt(1.0 + 4.0 * ratio**4) - 2.0 * ratio**2)
        gain = 1.0 / (1j * w * (1j * w + 2.0 * ratio))
        assert abs(gain) == pytest.approx(1.0)
        expected = 180.0 + math.degrees(np.angle(gain))
        assert damping_margin(ratio) == pytest.approx(expected, abs=1e-9)
    with pytest.raises(InputError, match="above 0"):
        damping_margin(0.0)


@settings(max_examples=30, deadline=None)
@given(st.floats(10.0, 60.0), st.floats(0.0, 20.0))
def test_design_by_margin_gives_the_margin(frequency: float, lead: float) -> None:
    """A PD that leads by up to 20 deg: crossover and margin come out as asked for."""
    bare = 180.0 + math.degrees(
        np.angle(np.polyval(NUM, z := np.exp(1j * frequency * DT)) / np.polyval(DEN, z))
    )
    taps = pd_by_margin(NUM, DEN, DT, frequency, bare + lead)
    found = first_crossover(*open_loop(taps, NUM, DEN), DT)
    assert found.frequency == pytest.approx(frequency, rel=1e-6)
    assert found.phase_margin == pytest.approx(bare + lead, abs=1e-4)


@settings(max_examples=30, deadline=None)
@given(st.floats(1.0, 12.0), st.floats(0.0, 0.01))
def test_design_by_derivative_time(frequency: float, time: float) -> None:
    taps = pd_by_time(NUM, DEN, DT, frequency, time)
    assert taps.derivative_time(DT) == pytest.approx(time, abs=1e-12)
    found = first_crossover(*open_loop(taps, NUM, DEN), DT)
    assert found.frequency == pytest.approx(frequency, rel=1e-6)


def test_lowest_frequency_needs_no_derivative() -> None:
    """Near (4.9): a damping ratio of 1 at its lowest frequency is a bare gain."""
    w = lowest_frequency(NUM, DEN, DT, damping_margin(1.0))
    assert w == pytest.approx(9.89, abs=0.01)
    taps = pd_by_margin(NUM, DEN, DT, w, damping_margin(1.0))
    assert taps.before == pytest.approx(0.0, abs=1e-9)


def test_bad_numbers() -> None:
    with pytest.raises(InputError, match="Nyquist"):
        pd_by_margin(NUM, DEN, DT, 4000.0, 60.0)
    with pytest.raises(InputError, match="Nyquist"):
        pd_by_time(NUM, DEN, DT, 0.0, 0.01)
    with pytest.raises(InputError, match="phase margin"):
        lowest_frequency(NUM, DEN, DT, 120.0)
    with pytest.raises(InputError, match="never crosses 1"):
        first_crossover([0.5], [1.0], DT)
    with pytest.raises(InputError, match="dt"):
        crossovers(NUM, DEN, 0.0)


@settings(max_examples=40, deadline=None)
@given(st.floats(1.0, 60.0), st.integers(0, 8))
def test_margins_of_an_integrator_with_delay(gain: float, late: int) -> None:
    """gain dt z^-late / (z - 1): its phase is -90 deg - (late + 1/2) w dt, its size
    gain dt / (2 sin(w dt / 2))."""
    found = margins([gain * DT], [1.0, -1.0, *[0.0] * late], DT)
    limit = 2.0 * math.sin(math.pi / (2.0 * (2 * late + 1))) / (gain * DT)
    w = 2.0 / DT * math.asin(gain * DT / 2.0)
    phase = math.pi / 2.0 - (late + 0.5) * w * DT
    assert found.stable
    assert found.gain == pytest.approx(limit, rel=1e-8)
    assert found.gain_down == 0.0
    assert found.phase == pytest.approx(math.degrees(phase), abs=1e-6)
    assert found.delay == pytest.approx(phase / w, rel=1e-8)


@given(st.floats(0.01, 0.95))
def test_disk_margin_of_a_gain_with_delay(gain: float) -> None:
    """gain / z comes nearest to -1 at the Nyquist frequency, where it is -gain: the disk
    reaches just as far as the gain margin 1 / gain."""
    found = margins([gain], [1.0, 0.0], DT)
    assert found.disk == pytest.approx(2.0 * (1.0 - gain) / (1.0 + gain), rel=1e-6)
    assert found.disk_gain == pytest.approx(1.0 / gain, rel=1e-5)
    assert found.gain == pytest.approx(1.0 / gain, rel=1e-9)
    assert found.peak_s == pytest.approx(1.0 / (1.0 - gain), rel=1e-6)
    assert found.peak_t == pytest.approx(gain / (1.0 - gain), rel=1e-6)
    assert found.delay == math.inf  # its gain never is 1


def test_disk_margin_of_a_published_loop() -> None:
    """25 / (s^3 + 10 s^2 + 10 s + 10), the example of Seiler, Packard and Gahinet: a disk
    margin of 0.46, gains from 0.63 to 1.59, phases within 25.8 deg. By the bilinear rule,
    which bends the frequencies but keeps every peak."""
    c, den = 2.0 / DT, np.zeros(4)
    for power, weight in zip((3, 2, 1, 0), (1.0, 10.0, 10.0, 10.0), strict=True):
        part = np.array([weight * c**power])
        for k in range(3):
            part = np.convolve(part, [1.0, -1.0] if k < power else [1.0, 1.0])
        den += part
    found = margins(25.0 * np.convolve([1.0, 1.0], np.convolve([1.0, 1.0], [1.0, 1.0])), den, DT)
    assert found.disk == pytest.approx(0.46, abs=0.005)
    assert 1.0 / found.disk_gain == pytest.approx(0.63, abs=0.005)
    assert found.disk_gain == pytest.approx(1.59, abs=0.006)
    assert found.disk_phase == pytest.approx(25.8, abs=0.1)
    assert found.gain == pytest.approx(3.6, rel=1e-3)  # by Routh: (10 10 - 10) / 25


@pytest.mark.parametrize("taps", [PdTaps(0.00245865, 0.0000998447), PdTaps(0.0124593, -0.0112178)])
def test_margins_are_where_stability_ends(taps: PdTaps) -> None:
    """The roots of the closed loop say so: just within each margin stable, just beyond not."""
    num, den = open_loop(taps, NUM, DEN)
    found = margins(num, den, DT)
    assert found.disk_gain < found.gain
    assert found.disk_phase < found.phase
    assert is_stable(0.999 * found.gain * num, den)
    assert not is_stable(1.001 * found.gain * num, den)
    samples = found.delay / DT
    assert is_stable(num, np.append(den, np.zeros(math.floor(samples))))
    assert not is_stable(num, np.append(den, np.zeros(math.ceil(samples))))


def test_a_conditionally_stable_loop_has_a_lower_gain_margin() -> None:
    """2 / (z - 1.5): the closed loop's pole is 1.5 - 2 k, within the circle for k from 0.25
    to 1.25."""
    found = margins([2.0], [1.0, -1.5], DT)
    assert found.gain_down == pytest.approx(0.25)
    assert found.gain == pytest.approx(1.25)


def test_an_unstable_loop_has_no_margins() -> None:
    found = margins([3.0], [1.0, 0.0], DT)
    assert not found.stable
    assert all(math.isnan(value) for value in found[1:])
    with pytest.raises(InputError, match="dt"):
        margins([0.5], [1.0, 0.0], -1.0)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_a_common_factor_of_both_polynomials_changes_no_margin(scale: float) -> None:
    num, den = np.array([2.0]), np.array([1.0, -1.5])
    found = margins(scale * num, scale * den, DT)
    assert found == pytest.approx(margins(num, den, DT), rel=1e-9)


@pytest.mark.parametrize("angle", [0.7, 0.701, 0.702, 0.703, 0.9, 2.5, 3.1])
@pytest.mark.parametrize("radius", [0.9, 0.999])
def test_a_sharp_resonance_is_found_between_the_frequencies_of_the_grid(
    angle: float, radius: float
) -> None:
    """T = g / (z^2 - 2 r cos(a) z + r^2) has its peak g / ((1 - r^2) |sin a|) where
    cos(w dt) = (1 + r^2) cos(a) / (2 r), if there is such a frequency."""
    closed = np.array([1.0, -2.0 * radius * math.cos(angle), radius * radius])
    g = 1e-3
    den = closed - np.array([0.0, 0.0, g])
    found = margins([g], den, DT)
    if abs((1.0 + radius**2) * math.cos(angle) / (2.0 * radius)) <= 1.0:
        peak = g / ((1.0 - radius**2) * math.sin(angle))
    else:
        peak = g / abs(np.polyval(closed, -1.0))
    assert found.stable
    assert found.peak_t == pytest.approx(peak, rel=1e-7)


def test_gains_that_end_stability_at_the_lowest_and_the_highest_frequency() -> None:
    """-0.5 / z: the closed loop's pole is 0.5 k, at z = 1 with k = 2; 0.5 / z ends at z = -1."""
    for sign in (1.0, -1.0):
        found = margins([sign * 0.5], [1.0, 0.0], DT)
        assert (found.gain, found.gain_down) == (pytest.approx(2.0), 0.0)


def test_an_integrator_has_no_gain_at_rest_that_ends_stability() -> None:
    """-0.1 / (z - 1) with positive feedback is unstable for any gain; 0.1 / (z - 1) ends at
    z = -1 with 20."""
    assert not margins([-0.1], [1.0, -1.0], DT).stable
    found = margins([0.1], [1.0, -1.0], DT)
    assert (found.gain, found.gain_down) == (pytest.approx(20.0), 0.0)


@pytest.mark.parametrize("dt", [1e-3, 0.1])
@pytest.mark.parametrize(("share", "found"), [(2e-5, True), (5e-6, False), (0.15, True)])
def test_the_lowest_frequency_is_sought_within_what_a_loop_can_use(
    dt: float, share: float, found: bool
) -> None:
    """From 1e-5 of the Nyquist frequency to a fifth of it: a pole there leaves 45 deg of margin
    to an integrator, less half a sample's and the pole's own delay."""
    w = share * math.pi / dt
    den = np.convolve([1.0, -1.0], [1.0, -math.exp(-w * dt)])
    if found:
        at = lowest_frequency([1.0], den, dt, 40.0)
        phase = np.angle(np.polyval([1.0], 1.0) / np.polyval(den, np.exp(1j * at * dt)))
        assert math.degrees(phase) % 360.0 == pytest.approx(180.0 + 40.0, abs=1e-3)
    else:
        with pytest.raises(InputError, match="a margin that the plant passes through"):
            lowest_frequency([1.0], den, dt, 45.0)


@pytest.mark.parametrize("late", [0, 1, 2])
def test_of_several_crossovers_the_margin_of_least_size_counts(late: int) -> None:
    """A resonance that pushes the right way crosses 1 twice, far from -1 on either side; a delay
    turns one of the two nearer."""
    num = 0.02 * np.array([1.0, 0.0, -1.0])
    den = np.append([1.0, -2.0 * 0.99 * math.cos(0.3), 0.99**2], np.zeros(late))
    found, each = margins(num, den, DT), crossovers(num, den, DT)
    assert found.stable and len(each) == 2
    assert found.phase == pytest.approx(min((c.phase_margin for c in each), key=abs))
    assert {c.phase_margin < 0.0 for c in each} == {True, False}
    assert found.crossover in [c.frequency for c in each]
