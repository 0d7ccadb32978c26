"""Section 2.3 tested on the bench's wires and with the textbook's law."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.plant.bench import Bench
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.thesis.chapter2 import _calorimetry, _wire_tests
from macromicro.thesis.chapter2._calorimetry import Scan
from macromicro.thesis.chapter2._wire_tests import HOT, ROOM, Readings, Specimen, Turning
from macromicro.thesis.chapter2.shape_memory import Alloy, detwinned, strain

# Figure 2.8: the load of the kiln [gf], and turning temperatures inside the loop [degC].
LOAD = 30.0
MINOR = (102.0, 70.0, 98.0, 76.0, 105.0, 60.0, 101.0, 82.0, HOT)
# Figure 2.9 (c): temperatures [degC] at which the wires are pulled, and the load [gf].
PULLED_AT = (25.0, 90.0, 99.0, 103.0, 106.0, 120.0)
MOST = 70.0
# Figure 2.10: the load that is lifted and the one that stays [gf]; stresses of the law [Pa].
LIFTED, STAYING = 30.0, 30.0
HIGH, BIAS = 150e6, 100e6


class Law(NamedTuple):
    """A test with the textbook's law: strain (a ratio) and stress [Pa], shape (points,) each."""

    strain: Array
    stress: Array


class Cycle(NamedTuple):
    """A cycle A-B-C-D-A: strains and stresses [Pa]."""

    strain: Array
    stress: Array
    states: tuple[int, int, int, int]  # indices of A to D
    area: float  # enclosed: work per volume [J/m^3]
    lifting: float  # lifted stress times strain from A to B [J/m^3]


class Principle(NamedTuple):
    """The data of Figures 2.8-2.10 and A.1; `turnings`: on heating, on cooling."""

    specimen: Specimen
    major: Readings
    turnings: tuple[Turning, Turning]
    minor: Readings
    pulled: list[Readings]
    cycle: Readings
    bench_cycle: Cycle
    law_cycle: Cycle
    scans: tuple[Scan, Scan]


def collect(bench: Bench) -> Principle:
    s = _wire_tests.specimen(bench)
    major = _wire_tests.tested(
        s, *_wire_tests.path((ROOM, LOAD), (HOT, LOAD), (ROOM, LOAD), each=400)
    )
    up, down = (
        _wire_tests.tangents(major.temperature[part], major.extension[part])
        for part in (slice(0, 401), slice(400, None))
    )
    minor = _wire_tests.tested(
        s, *_wire_tests.path((ROOM, LOAD), *((t, LOAD) for t in MINOR), (ROOM, LOAD))
    )
    pulled = [
        _wire_tests.tested(s, *_wire_tests.path((ROOM, 0.0), (t, 0.0), (t, MOST), (t, 0.0)))
        for t in PULLED_AT
    ]
    both = LIFTED + STAYING
    cycle = _wire_tests.tested(
        s,
        *_wire_tests.path((ROOM, both), (HOT, both), (HOT, STAYING), (ROOM, STAYING), (ROOM, both)),
    )
    return Principle(
        s,
        major,
        (up, down),
        minor,
        pulled,
        cycle,
        _bench_cycle(s, cycle),
        law_cycle(Alloy()),
        _calorimetry.scan(s),
    )


def _bench_cycle(s: Specimen, r: Readings) -> Cycle:
    each = (len(r.load) - 1) // 4
    return _cycle(
        r.extension / s.length,
        r.load / s.area,
        (0, each, 2 * each, 3 * each),
        LIFTED * GRAM_FORCE / s.area,
    )


def _cycle(
    strains: Array, stresses: Array, states: tuple[int, int, int, int], lifted: float
) -> Cycle:
    area = _wire_tests.enclosed(strains, stresses)
    return Cycle(
        strains, stresses, states, area, lifted * float(strains[states[0]] - strains[states[1]])
    )


def law_cycle(alloy: Alloy, each: int = 100) -> Cycle:
    """Figure 2.10 by the law.

    A to B heated under both loads, C after the lifted one is gone, D cooled under the other, and
    back to A as the next load is put on.
    """
    legs = (
        (HIGH, HIGH, 0.0, 1.0),
        (HIGH, BIAS, 1.0, 1.0),
        (BIAS, BIAS, 1.0, 0.0),
        (BIAS, HIGH, 0.0, 0.0),
    )
    stresses, shares = (
        np.concatenate([np.linspace(leg[k], leg[k + 1], each, endpoint=False) for leg in legs])
        for k in (0, 2)
    )
    share = np.ones_like(stresses)
    # Austenite has no twins to have moved: what comes back from C carries what the bias moves.
    back = detwinned(alloy, BIAS, 0.0)
    for k in range(2 * each, 4 * each):
        back = detwinned(alloy, float(stresses[k]), back)
        share[k] = back
    strains = np.array(
        [strain(alloy, *v) for v in zip(stresses, shares, share, strict=True)], dtype=float
    )
    return _cycle(strains, stresses, (0, each, 2 * each, 3 * each), HIGH - BIAS)


def loaded(alloy: Alloy, austenite: float, top: float, points: int = 200) -> Law:
    """Loading to `top` [Pa] and unloading by the law, at a share of austenite, twinned."""
    stresses = np.concatenate((np.linspace(0.0, top, points), np.linspace(top, 0.0, points)))
    share, strains = 0.0, np.empty_like(stresses)
    for k, value in enumerate(stresses.tolist()):
        share = detwinned(alloy, value, share)
        strains[k] = strain(alloy, value, austenite, share)
    return Law(strains, stresses)
