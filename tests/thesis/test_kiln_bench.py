"""The kiln: Section 5.2.1, Figures 5.3-5.5 and 5.8."""

from __future__ import annotations

import numpy as np
import pytest
from tests.plant.drives import tempered
from tests.thesis.fixture_drives import fire

from macromicro.plant.flexure import GRAM_FORCE
from macromicro.thesis import kiln_bench
from macromicro.thesis.kiln_bench import KilnBench

SPEC = KilnBench()


@pytest.fixture(scope="module")
def run() -> np.ndarray:
    """600 s of heating, 1600 s of cooling, 100 samples a second."""
    return fire(np.r_[np.ones(60000), np.zeros(160000)])


@pytest.mark.slow
def test_reaches_115_degrees_and_cools_again(run: np.ndarray) -> None:
    """Section 5.2.1: the temperature range of the first-order descending curves."""
    wires = run[2]
    assert wires.max() > 115.0
    assert wires[-1] < 30.0
    assert wires.min() >= SPEC.oven.ambient - 1e-9
    assert run[1].max() == pytest.approx(3.98e-3 / 14e-6, abs=1.0)
    assert run[1][-1] <= 1


def test_spikes_exceed_five_kelvin_and_are_rare(run: np.ndarray) -> None:
    """Section 5.2.1, Figure 5.5 (S1): interference far above the thermocouple's noise."""
    quiet = SPEC._replace(oven=SPEC.oven._replace(spike_rate=0.0))
    clean = fire(np.r_[np.ones(60000), np.zeros(160000)], spec=quiet)
    spikes = run[0] - clean[0]
    assert np.abs(spikes).max() > 5.0
    assert (spikes > 5.0).any() and (spikes < -5.0).any()
    spoilt = float((np.abs(spikes) > 1.0).mean())
    assert 0.005 < spoilt < 0.1
    starts = int(((np.abs(spikes[1:]) > 1.0) & (np.abs(spikes[:-1]) <= 1.0)).sum())
    assert starts == pytest.approx(SPEC.oven.spike_rate * 2200.0, rel=0.5)


def test_thermocouple_follows_the_wires_within_a_few_kelvin(run: np.ndarray) -> None:
    """Section 5.2.1: it sits on the top plate, not on the wires."""
    assert np.median(np.abs(run[0] - run[2])) < 1.0


def test_encoder_reads_14_micrometres() -> None:
    """Section 5.2.1."""
    p = kiln_bench.prepare(SPEC)
    s = kiln_bench.initial(p)
    for x, count in ((0.0, 0.0), (20e-6, 1.0), (21.1e-6, 2.0), (140e-6, 10.0)):
        placed = s._replace(wire=s.wire._replace(x=x))
        assert kiln_bench.measure(p, placed, 0.0, kiln_bench.KilnNoise()).encoder == count


def test_weight_is_thirty_grams() -> None:
    """Section 5.2.1."""
    assert kiln_bench.prepare(SPEC).load.preload == pytest.approx(30.0 * GRAM_FORCE)


def test_full_contraction_at_107_5_degrees() -> None:
    """Section 5.2.2 (S6): 107.5 +-1.5 degC, on heating through the kiln's table."""
    grid = np.linspace(25.0, 115.0, 3601)
    full = grid[int(np.argmax(tempered(grid) >= 3.98e-3 - 1e-9))]
    assert full == pytest.approx(107.5, abs=1.5)


def test_same_draws_same_bits() -> None:
    heater = np.ones(500)
    assert fire(heater, 4).tobytes() == fire(heater, 4).tobytes()
    assert fire(heater, 4).tobytes() != fire(heater, 5).tobytes()


def test_wires_hang_in_air_that_is_a_share_cooler_than_the_top_plate() -> None:
    """Section 5.2.1: the thermocouple is above them. Held long enough, the wires' excess over
    the room is the air's less the gradient; a kiln as cold as the room shows none."""
    spec = SPEC._replace(oven=SPEC.oven._replace(gradient=0.1, spike_rate=0.0))
    p = kiln_bench.prepare(spec)
    s = kiln_bench.initial(p)._replace(air=85.0, thermocouple=85.0)
    held = s
    for _ in range(6000):
        held = kiln_bench.advance(
            p, held._replace(air=85.0), 0.0, kiln_bench.KilnNoise(0.0, 1.0, 1.0), 0.01
        )
    assert held.wire.temperature == pytest.approx(25.0 + 0.9 * 60.0, abs=0.05)
    cold = kiln_bench.advance(
        p, kiln_bench.initial(p), 0.0, kiln_bench.KilnNoise(0.0, 1.0, 1.0), 0.01
    )
    assert cold.wire.temperature == pytest.approx(25.0)
