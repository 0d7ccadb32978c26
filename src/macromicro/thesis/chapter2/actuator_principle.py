"""Principle of the actuator (Section 2.3) and calorimetry (Appendix A)."""

from __future__ import annotations

import math
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from macromicro.arrays import Array
from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    PURPLE,
    RED,
    finish,
    line,
    new,
    note,
    single,
)
from macromicro.schema.par import Par
from macromicro.thesis.chapter2 import _actuator_runs as runs
from macromicro.thesis.chapter2._actuator_runs import Alloy, Cycle, Principle, Readings
from macromicro.thesis.contents import caption
from macromicro.thesis.procedure import Lab

_LIT = "literature value for NiTi"


class Filament(NamedTuple):
    """A round NiTi wire in air."""

    diameter: Annotated[
        float, Par("m", "diameter: the bench's cross-section", shown="um", positive=True)
    ] = 135e-6
    density: Annotated[float, Par("kg/m^3", "density", _LIT, positive=True)] = 6450.0
    heat: Annotated[
        float, Par("J/(kg*K)", "specific heat (450-840 J/kg/K)", _LIT, positive=True)
    ] = 500.0
    resistivity: Annotated[
        float, Par("ohm*m", "resistivity of martensite (80 micro-ohm cm)", _LIT, positive=True)
    ] = 0.8e-6
    convection: Annotated[
        float, Par("W/(m^2*K)", "convection of so thin a wire in still air", positive=True)
    ] = 100.0
    ambient: Annotated[float, Par("degC", "temperature of the air", "Section 5.2.2")] = 25.0


def time_constant(p: Filament) -> float:
    """rho Cp V / (h A) = rho Cp d / (4 h), s."""
    return p.density * p.heat * p.diameter / (4.0 * p.convection)


def steady(p: Filament, current: float) -> float:
    """Steady temperature at a constant current: T_inf + R i^2 / (h A), deg C."""
    resistance = p.resistivity / (0.25 * math.pi * p.diameter**2)
    return p.ambient + resistance * current**2 / (p.convection * math.pi * p.diameter)


def temperature(p: Filament, current: Array, dt: float) -> Array:
    """Temperature under a stepwise constant current from cold (exact solution of (2.1)), deg C."""
    keep = math.exp(-dt / time_constant(p))
    now, out = p.ambient, np.empty_like(current)
    for k, i in enumerate(current.tolist()):
        end = steady(p, i)
        now = end + (now - end) * keep
        out[k] = now
    return out


_SERIES = (BLUE, GREEN, ORANGE, RED, PURPLE, BLACK)
_LAW = ("martensite", "unloading")  # names of the two legs


def hysteresis(data: Principle) -> Drawn:
    figure, axes = new(3.7, 1, 2, sharey=True)
    major, minor = axes[0]
    _branches(major, data.major)
    length = 1e3 * data.major.extension
    names = (("A", data.turnings[0], RED), ("M", data.turnings[1], BLUE))
    for letter, turn, colour in names:
        levels = (length[0], length.min()) if letter == "A" else (length.min(), length[0])
        ends = np.array([turn.start, turn.finish])
        major.plot(ends, levels, color=colour, linewidth=0.9, linestyle="--")
        for place, level, mark in zip(ends, levels, "sf", strict=True):
            major.plot(place, level, "o", color=colour, markersize=4)
            above = level == length[0]
            note(major, f"${letter}_{mark}$", (place, level), (-4, 6 if above else -14), fontsize=9)
    _branches(minor, data.minor)
    labels = ("temperature [degC]", "length - cold, unloaded length [mm]")
    finish(major, "(a) major loop", *labels, legend="lower left")
    finish(minor, "(b) minor loops", labels[0])
    major.set_ylim(-4.6, 0.6)
    (a_s, a_f, _), (m_s, m_f, _) = data.turnings
    return caption("2.8", figure, load=runs.LOAD, a_s=a_s, a_f=a_f, m_s=m_s, m_f=m_f)


def _branches(ax: Any, r: Readings) -> None:
    warming = np.gradient(r.temperature) > 0.0
    for which, colour, name in ((warming, RED, "heating"), (~warming, BLUE, "cooling")):
        line(ax, r.temperature, np.where(which, 1e3 * r.extension, np.nan), colour, name)


def stress_strain(data: Principle) -> Drawn:
    alloy = Alloy()
    figure, axes = new(3.7, 1, 3)
    phases, between, wires = axes[0]
    for top, *names in ((90e6, "", ""), (115e6, "", ""), (140e6, "", ""), (200e6, *_LAW)):
        up, down = _law(alloy, 0.0, top)
        line(phases, *up, BLUE, names[0])
        line(phases, *down, BLUE, names[1], linestyle="--")
    for leg, name in zip(_law(alloy, 1.0, 200e6), ("austenite", ""), strict=True):
        line(phases, *leg, RED, name)
    for share, colour in zip((0.0, 0.25, 0.5, 0.75, 1.0), _SERIES, strict=False):
        line(between, *_law(alloy, share, 200e6)[0], colour, f"{100 * share:.0f} % austenite")
    each = (len(data.pulled[0].load) - 1) // 3
    for r, t, colour in zip(data.pulled, runs.PULLED_AT, _SERIES, strict=False):
        x = 100.0 * r.extension[each:] / data.specimen.length
        y = 1e-6 * r.load[each:] / data.specimen.area
        line(wires, x, y, colour, f"{t:g} degC")
    small: Any = {"legend": "lower right", "fontsize": 7, "frameon": True, "edgecolor": "none"}
    finish(phases, "(a) law", "strain [%]", "stress [MPa]", **small)
    finish(between, "(b) law, transition", "strain [%]", **small)
    above: Any = {"legend": "upper center", "fontsize": 7, "ncols": 3, "columnspacing": 1.0}
    finish(wires, "(c) the bench's wires", "strain [%]", **above)
    wires.set_ylim(-2.0, 68.0)
    moduli = (1e-9 * alloy.martensite, 1e-9 * alloy.austenite)
    return caption(
        "2.9",
        figure,
        moduli=moduli,
        plateau=100 * alloy.plateau_strain,
        start=1e-6 * alloy.plateau_start,
        end=1e-6 * alloy.plateau_end,
        load=runs.MOST,
        left=_beyond_elastic(data),
    )


def _law(alloy: Alloy, austenite: float, top: float) -> tuple[tuple[Array, Array], ...]:
    """Strain [%] and stress [MPa] by the law, loading to `top` [Pa] and unloading."""
    run = runs.load_and_unload(alloy, austenite, top)
    x, y = 100.0 * run.strain, 1e-6 * run.stress
    half = len(x) // 2
    return (x[:half], y[:half]), (x[half:], y[half:])


def _beyond_elastic(data: Principle) -> float:
    """Largest strain [%] of a pulled wire beyond elasticity.

    The stiffness comes from the coldest and the hottest test, weighted by the strain without load.
    """
    each = (len(data.pulled[0].load) - 1) // 3
    bare, full = np.array([r.extension[[each, 2 * each]] for r in data.pulled]).T
    given = full - bare
    share = (bare - bare[0]) / (bare[-1] - bare[0])
    elastic = given[0] + share * (given[-1] - given[0])
    return float(100.0 * np.max(given - elastic) / data.specimen.length)


def work(data: Principle) -> Drawn:
    alloy = Alloy()
    figure, axes = new(3.9, 1, 3, gridspec_kw={"width_ratios": [1.1, 1, 1]})
    law, steps, bench = axes[0]
    for share, colour, name in ((0.0, "0.6", "martensite"), (1.0, "0.3", "austenite")):
        line(law, *_law(alloy, share, 190e6)[0], colour, name, linestyle=":")
    _cycle(law, data.law_cycle, ((-4, 6), (-12, 5), (-13, -10), (5, -11)))
    _cycle(bench, data.bench_cycle, ((4, 4), (-10, 6), (-10, -12), (4, -12)))
    r = data.cycle
    for ax, (left, right) in ((law, (-0.45, 5.2)), (bench, (-4.6, 0.7))):
        ax.set_xlim(left, right)
    law.set_ylim(0.0, 195.0)
    bench.set_ylim(17.0, 44.5)
    line(steps, r.temperature, 1e3 * r.extension, BLUE, "")
    for name, k in zip("ABCD", data.bench_cycle.states, strict=True):
        place = (r.temperature[k], 1e3 * r.extension[k])
        steps.plot(*place, "o", color=BLACK, markersize=4)
        aside = {"A": (2, 5), "B": (-6, 7), "C": (-6, -14), "D": (2, -14)}[name]
        note(steps, name, place, aside, fontsize=9)
    steps.set_ylim(-4.8, 0.7)
    left, right = law.get_xlim(), bench.get_xlim()
    finish(law, "(a) by the law", "strain [%]", "stress [MPa]")
    finish(steps, "(b) wires: length", "temperature [degC]", "length [mm]")
    finish(bench, "(c) wires: work", "strain [%]", "stress [MPa]")
    law.set_xlim(left)
    bench.set_xlim(right)
    figure.subplots_adjust(wspace=0.32, left=0.07)
    volume = data.specimen.area * data.specimen.length
    own, theirs = data.bench_cycle, data.law_cycle
    return caption(
        "2.10",
        figure,
        load=runs.LIFTED,
        area=1e3 * own.area * volume,
        lifting=1e3 * own.lifting * volume,
        apart=_off_time(own),
        bias=1e-6 * runs.BIAS,
        high=1e-6 * runs.LAW_HIGH,
        law_area=1e-6 * theirs.area,
        law_lifting=1e-6 * theirs.lifting,
        law_apart=_off_time(theirs),
    )


def _off_time(c: Cycle) -> str:
    return f"{100.0 * abs(c.area / c.lifting - 1.0):.1f} %"


def _cycle(ax: Any, c: Cycle, aside: tuple[tuple[int, int], ...]) -> None:
    x, y = 100.0 * c.strain, 1e-6 * c.stress
    ax.fill(x, y, color=ORANGE, alpha=0.25, linewidth=0)
    line(ax, np.append(x, x[0]), np.append(y, y[0]), BLUE, "")
    for name, k, offset in zip("ABCD", c.states, aside, strict=True):
        ax.plot(x[k], y[k], "o", color=BLACK, markersize=4)
        note(ax, name, (x[k], y[k]), offset, fontsize=9)


def heat(_: Principle) -> Drawn:
    """(2.1): a wire heated by current pulses, in still and in moving air."""
    still = Filament()
    moving = still._replace(convection=3.0 * still.convection)
    dt = 0.01
    t = np.linspace(dt, 1200 * dt, 1200)
    figure, axes = new(3.5, 1, 2, sharey=True)
    left, right = axes[0]
    for amps, colour in ((0.15, BLUE), (0.20, GREEN), (0.25, RED)):
        line(left, t, _pulse(still, amps, t, dt), colour, f"{amps:g} A")
    for wire, colour, name in ((still, RED, "still air"), (moving, PURPLE, "moving air")):
        tau = time_constant(wire)
        amps = 0.25 * (wire.convection / still.convection) ** 0.5
        curve = _pulse(wire, amps, t, dt)
        line(right, t, curve, colour, f"{name}, {amps:.2f} A: {tau:.2f} s")
        half = len(t) // 2
        level = wire.ambient + (curve[half - 1] - wire.ambient) * np.exp(-1.0)
        right.plot(t[half - 1] + tau, level, "o", color=BLACK, markersize=4)
    left.set_ylim(20.0, 132.0)
    finish(left, "(a) current on for 6 s", y="temperature [degC]", legend="upper right")
    finish(right, "(b) cooling by the air; dots: one time constant", legend="upper right")
    return caption(
        "(2.1)",
        figure,
        diameter=1e6 * still.diameter,
        still=still,
        resistivity=1e8 * still.resistivity,
        moving=moving,
        still_time=time_constant(still),
        moving_time=time_constant(moving),
    )


def _pulse(wire: Filament, amps: float, t: NDArray[np.float64], dt: float) -> NDArray[np.float64]:
    """Temperatures [degC] with the current [A] on during the first half."""
    on = np.where(np.arange(len(t)) < len(t) // 2, amps, 0.0)
    return temperature(wire, on, dt)


def calorimeter(data: Principle) -> Drawn:
    figure, ax = single(3.8)
    found = [runs.peak(scan) for scan in data.scans]
    named = zip(data.scans, found, (RED, BLUE), ("heating", "cooling"), strict=True)
    for scan, peak, colour, name in named:
        flow = 1e-3 * scan.flow / scan.mass
        line(ax, scan.sample, flow, colour, name)
        for place, word in zip(peak[:3], ("onset", "peak", "end"), strict=True):
            order = np.argsort(scan.sample)
            level = float(np.interp(place, scan.sample[order], flow[order]))
            ax.plot(place, level, "o", color=colour, markersize=4)
            hot = name == "heating"
            aside, side = (-5, "right") if word == "onset" and hot else (5, "left")
            offset = (aside, 4 if hot else -12)
            note(ax, f"{word} {place:.0f}", (place, level), offset, ha=side)
    ax.set_ylim(-0.23, 0.46)
    finish(ax, "", "temperature of the sample [degC]", "heat flow, in: up [W/g]", legend=True)
    put = data.specimen.wire.latent / data.scans[0].mass
    up, down = found
    return caption(
        "A.1",
        figure,
        rate=60 * runs.RATE,
        mass=1e6 * data.scans[0].mass,
        heating=1e-3 * up.heat,
        cooling=1e-3 * down.heat,
        latent=1e-3 * put,
    )


def collect(lab: Lab) -> Principle:
    return runs.collect(lab.settings.bench)
