"""Section 2.3 tested on the bench's wires and with the textbook's law."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.hysteresis import Everett
from macromicro.plant import micro, phase, wire
from macromicro.plant.bench import Bench
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.plant.wire import Load, Wire
from macromicro.schema.par import Par

_DATA = "data sheets of NiTi"


class Alloy(NamedTuple):
    """A NiTi alloy; moduli and plateau as data sheets give them, strain as Section 3.2.1."""

    martensite: Annotated[
        float, Par("Pa", "modulus of martensite (28-41 GPa)", _DATA, shown="GPa", positive=True)
    ] = 28e9
    austenite: Annotated[
        float, Par("Pa", "modulus of austenite (75-83 GPa)", _DATA, shown="GPa", positive=True)
    ] = 75e9
    plateau_start: Annotated[
        float, Par("Pa", "stress at which twins begin to move", _DATA, shown="MPa", positive=True)
    ] = 70e6
    plateau_end: Annotated[
        float, Par("Pa", "stress at which all have moved", _DATA, shown="MPa", positive=True)
    ] = 140e6
    plateau_strain: Annotated[
        float, Par("1", "strain of the plateau", "stroke over wire length, about 4 %", lo=0.0)
    ] = 0.04


def detwinned_share(p: Alloy, stress: float, before: float) -> float:
    """Share of the plateau's strain under a stress; unloading recovers nothing."""
    share = (stress - p.plateau_start) / (p.plateau_end - p.plateau_start)
    return max(before, min(max(share, 0.0), 1.0))


def strain(p: Alloy, stress: float, austenite: float, share: float) -> float:
    """Strain under a stress: phases in series, and the plateau's strain of the martensite."""
    elastic = (1.0 - austenite) / p.martensite + austenite / p.austenite
    return stress * elastic + (1.0 - austenite) * share * p.plateau_strain


_HANGING = Load(0.0, 0.0, 0.0)  # without a load of its own
ROOM, HOT = 25.0, 125.0


class Specimen(NamedTuple):
    wire: Wire
    table: Everett
    capacity: float

    @property
    def area(self) -> float:
        """Cross-section [m^2], as measured with a caliper."""
        return self.wire.area

    @property
    def length(self) -> float:
        """Gauge length [m]: the cold wire without load."""
        return self.wire.length


class Readings(NamedTuple):
    """Temperature [degC], load [N] and extension [m] of the cold, unloaded length; (points,)."""

    temperature: Array
    load: Array
    extension: Array


def specimen(bench: Bench) -> Specimen:
    free = bench.wire._replace(stop=math.inf)
    return Specimen(free, phase.table(bench.phase), bench.thermal.wire_capacity)


def test_wires(s: Specimen, temperature: Array, load: Array) -> Readings:
    """The wires led through temperatures [degC] and loads [N], from martensite without load.

    Between two points both change together.
    """
    state = micro.cold_wire(s.wire, _HANGING, s.table, float(temperature[0]))
    extension = np.empty(len(temperature))
    for k, (t, force) in enumerate(zip(temperature.tolist(), load.tolist(), strict=True)):
        state = wire.tempered(s.wire, Load(force, 0.0, 0.0), s.table, state, t)
        contraction, _ = wire.geometry(s.wire, _HANGING, state.austenite, force)
        extension[k] = -contraction
    return Readings(np.array(temperature), np.array(load), extension)


def path(*points: tuple[float, float], each: int = 160) -> tuple[Array, Array]:
    """Temperatures [degC] and loads [N] along lines through (degC, gf), `each` points a line."""
    t, gf = np.array(points, dtype=float).T
    places = np.linspace(0.0, len(points) - 1.0, each * (len(points) - 1) + 1)
    index = np.arange(len(points))
    return np.interp(places, index, t), GRAM_FORCE * np.interp(places, index, gf)


class Turning(NamedTuple):
    """Start and finish [degC] of a transformation, by tangents, and the tangent's slope."""

    start: float
    finish: float
    slope: float


def tangents(temperature: Array, length: Array) -> Turning:
    """Where the steepest tangent of a branch meets its first and last reading.

    `length` over a `temperature` that runs one way. The tangent is a line through the readings
    within 1.5 K of the steepest place.
    """
    t, y = np.asarray(temperature), np.asarray(length)
    steep = int(np.argmax(np.abs(np.gradient(y, t))))
    near = np.abs(t - t[steep]) <= 1.5
    slope, level = np.polyfit(t[near], y[near], 1)
    return Turning(float((y[0] - level) / slope), float((y[-1] - level) / slope), float(slope))


def enclosed_area(x: Array, y: Array) -> float:
    """Area that a path encloses, closed by a straight line; always positive."""
    return abs(0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))


DENSITY = 6450.0  # kg/m^3, NiTi
RATE = 10.0 / 60.0  # K/s
RESISTANCE = 100.0  # K/W
LOW, HIGH = 5.0, 120.0
DT = 0.2


class Scan(NamedTuple):
    """One direction of the ramp, shape (points,) each: furnace and sample [degC], heat flow [W]."""

    furnace: Array
    sample: Array
    flow: Array
    mass: float


class Peak(NamedTuple):
    """A peak of the trace, at temperatures of the sample [degC]."""

    onset: float
    top: float
    end: float
    heat: float  # area over the baseline [J/kg], positive for heat taken in


def scan(s: Specimen) -> tuple[Scan, Scan]:
    ramp = np.arange(LOW, HIGH, RATE * DT)
    furnace = np.concatenate((ramp, ramp[::-1]))
    sample = np.empty_like(furnace)
    state = micro.cold_wire(s.wire, _HANGING, s.table, LOW)
    for k in range(len(furnace)):
        sample[k] = state.temperature
        gain = (furnace[k] - state.temperature) / RESISTANCE * DT
        state = wire.heated(s.wire, _HANGING, s.table, state, gain, 0.0, s.capacity)
    flow = (furnace - sample) / RESISTANCE
    mass = DENSITY * s.area * s.length
    up, down = slice(None, len(ramp)), slice(len(ramp), None)
    rising = Scan(furnace[up], sample[up], flow[up], mass)
    return rising, Scan(furnace[down], sample[down], flow[down], mass)


def peak(trace: Scan) -> Peak:
    """The peak of one direction, by the usual constructions.

    Baseline: a straight line between the mean flows over 4 K after the first 10 K, in which the
    ramp settles, and over the last 4 K. Onset and end: the steepest tangents before and after the
    top, extended to the baseline, averaged over 1 K.
    """
    t, flow = trace.sample, trace.flow
    gone, settled = np.abs(t - t[0]), 10.0
    first = (gone > settled) & (gone <= settled + 4.0)
    last = gone > gone[-1] - 4.0
    (t1, t2), (f1, f2) = ([float(c[part].mean()) for part in (first, last)] for c in (t, flow))
    over = flow - (f1 + (t - t1) * (f2 - f1) / (t2 - t1))
    inside = np.flatnonzero((gone > settled) & (gone < gone[-1] - 1.0))
    sign = 1.0 if t[-1] > t[0] else -1.0
    top = int(inside[np.argmax(sign * over[inside])])
    heat = float(np.sum(over[gone > settled])) * DT / trace.mass
    width = round(1.0 / (RATE * DT)) | 1
    smooth = np.convolve(over, np.full(width, 1.0 / width), "same")
    steep = np.gradient(smooth, DT * RATE * sign)
    rise, fall = inside[inside < top], inside[inside > top]
    before, after = int(rise[np.argmax(steep[rise])]), int(fall[np.argmin(steep[fall])])
    onset, end = (float(t[k] - smooth[k] / steep[k]) for k in (before, after))
    return Peak(onset, float(t[top]), end, heat)


# Figure 2.8: the load of the kiln [gf], and turning temperatures inside the loop [degC].
LOAD = 30.0
MINOR = (102.0, 70.0, 98.0, 76.0, 105.0, 60.0, 101.0, 82.0, HOT)
# Figure 2.9 (c): temperatures [degC] at which the wires are pulled, and the load [gf].
PULLED_AT = (25.0, 90.0, 99.0, 103.0, 106.0, 120.0)
MOST = 70.0
# Figure 2.10: the load that is lifted and the one that stays [gf]; stresses of the law [Pa].
LIFTED, STAYING = 30.0, 30.0
LAW_HIGH, BIAS = 150e6, 100e6


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
    s = specimen(bench)
    major = test_wires(s, *path((ROOM, LOAD), (HOT, LOAD), (ROOM, LOAD), each=400))
    up, down = (
        tangents(major.temperature[part], major.extension[part])
        for part in (slice(0, 401), slice(400, None))
    )
    minor = test_wires(s, *path((ROOM, LOAD), *((t, LOAD) for t in MINOR), (ROOM, LOAD)))
    pulled = [test_wires(s, *path((ROOM, 0.0), (t, 0.0), (t, MOST), (t, 0.0))) for t in PULLED_AT]
    both = LIFTED + STAYING
    cycle = test_wires(
        s, *path((ROOM, both), (HOT, both), (HOT, STAYING), (ROOM, STAYING), (ROOM, both))
    )
    lifted, each = LIFTED * GRAM_FORCE / s.area, (len(cycle.load) - 1) // 4
    own = _cycle(cycle.extension / s.length, cycle.load / s.area, each, lifted)
    law = law_cycle(Alloy())
    return Principle(s, major, (up, down), minor, pulled, cycle, own, law, scan(s))


def _cycle(strains: Array, stresses: Array, each: int, lifted: float) -> Cycle:
    """A cycle of four legs, each of as many points, that lifts a stress [Pa] from A to B."""
    lifting = lifted * float(strains[0] - strains[each])
    states = (0, each, 2 * each, 3 * each)
    return Cycle(strains, stresses, states, enclosed_area(strains, stresses), lifting)


def law_cycle(alloy: Alloy, each: int = 100) -> Cycle:
    """Figure 2.10 by the law.

    A to B heated under both loads, C after the lifted one is gone, D cooled under the other, and
    back to A as the next load is put on.
    """
    legs = (
        (LAW_HIGH, LAW_HIGH, 0.0, 1.0),
        (LAW_HIGH, BIAS, 1.0, 1.0),
        (BIAS, BIAS, 1.0, 0.0),
        (BIAS, LAW_HIGH, 0.0, 0.0),
    )
    stresses, shares = (
        np.concatenate([np.linspace(leg[k], leg[k + 1], each, endpoint=False) for leg in legs])
        for k in (0, 2)
    )
    share = np.ones_like(stresses)
    # Austenite has no twins to have moved: what comes back from C carries what the bias moves.
    back = detwinned_share(alloy, BIAS, 0.0)
    for k in range(2 * each, 4 * each):
        back = detwinned_share(alloy, float(stresses[k]), back)
        share[k] = back
    strains = np.array(
        [strain(alloy, *v) for v in zip(stresses, shares, share, strict=True)], dtype=float
    )
    return _cycle(strains, stresses, each, LAW_HIGH - BIAS)


def load_and_unload(alloy: Alloy, austenite: float, top: float) -> Law:
    """Loading to `top` [Pa] and unloading by the law, at a share of austenite, twinned."""
    stresses = np.concatenate((np.linspace(0.0, top, 200), np.linspace(top, 0.0, 200)))
    share, strains = 0.0, np.empty_like(stresses)
    for k, value in enumerate(stresses.tolist()):
        share = detwinned_share(alloy, value, share)
        strains[k] = strain(alloy, value, austenite, share)
    return Law(strains, stresses)
