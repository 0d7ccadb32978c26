"""The alloy wires: temperature, load and history give the contraction."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro import nominal
from macromicro.columns import Meaning
from macromicro.hysteresis import Everett, Memory, advance, peek
from macromicro.kernel import kernel
from macromicro.plant import VARIANT
from macromicro.plant.flexure import GRAM_FORCE
from macromicro.schema.par import Par

_LIT = "literature value for NiTi"
# Secant steps before every other one halves the bracket; all but freak inputs take fewer.
PATIENT = 12


class Wire(NamedTuple):
    """The six wires of the actuator taken as one; two halves in a row where they are unequal."""

    stroke: Annotated[
        float,
        Par(
            "m",
            "contraction by full transformation, unloaded",
            "calibrated to S3: just above the stop; Section 3.2.1 has 4 mm",
            shown="mm",
            positive=True,
        ),
    ] = 4.03e-3
    stop: Annotated[
        float, Par("m", "mechanical stop", "Section 5.2.2 (S3)", shown="mm", positive=True)
    ] = nominal.FINE_STOP
    length: Annotated[
        float, Par("m", "wire length in all", "stroke at 4 % strain", shown="mm", positive=True)
    ] = 0.1
    area: Annotated[
        float,
        Par(
            "m^2",
            "cross-section under the load",
            "wire mass of 9 mg",
            shown="mm^2",
            positive=True,
        ),
    ] = 1.44e-8
    martensite: Annotated[
        float, Par("Pa", "modulus of martensite", _LIT, shown="GPa", positive=True)
    ] = 30e9
    austenite: Annotated[
        float, Par("Pa", "modulus of austenite", _LIT, shown="GPa", positive=True)
    ] = 75e9
    latent: Annotated[
        float,
        Par(
            "J",
            "latent heat of the full transformation",
            "calibrated to S7, S13c, within 12-24 kJ/kg of the literature",
            lo=0.0,
        ),
    ] = 27.7 / 150.0
    shift: Annotated[
        float, Par("K/N", "rise of all thresholds with load (6.5-10 MPa/K)", _LIT, lo=0.0)
    ] = 0.085 / GRAM_FORCE
    reference_load: Annotated[
        float,
        Par("N", "load at which the thresholds hold: the kiln's 30 g", "Section 5.2.1", lo=0.0),
    ] = 30.0 * GRAM_FORCE
    unequal: Annotated[
        float,
        Par(
            "1",
            "half of the wires sheds so much more of its heat, the other half so much less",
            VARIANT,
            lo=0.0,
            hi=0.5,
        ),
    ] = 0.0
    creep: Annotated[
        float,
        Par("1", "creep per decade of time, of the contraction before", VARIANT, lo=0.0, hi=0.1),
    ] = 0.0
    creep_first: Annotated[float, Par("s", "time from which on creep counts", positive=True)] = 0.1


class Load(NamedTuple):
    """What the wires pull."""

    preload: Annotated[float, Meaning("force at full extension", "N")]
    rate: Annotated[float, Meaning("rise of the force with the contraction", "N/m")]
    mass: Annotated[float, Meaning("that moves", "kg")]


class WireState(NamedTuple):
    """State of the wires."""

    content: Annotated[float, Meaning("heat content, as temperature plus latent share", "K")]
    u: Annotated[float, Meaning("relay input", "degC")]
    slope: Annotated[float, Meaning("d(content)/du of the last step")]
    austenite: Annotated[float, Meaning("fraction, 0 to 1")]
    x: Annotated[float, Meaning("contraction", "m")]
    temperature: Annotated[float, Meaning("", "degC")]
    memory: Annotated[Memory, Meaning("memory of the relays")]


@kernel
def geometry(
    p: Wire, load: Load, austenite: float, inertia: float
) -> tuple[Annotated[float, Meaning(name="x")], Annotated[float, Meaning(name="force")]]:
    """Contraction and wire force for an austenite fraction.

    x = stroke xi - (elastic stretch now - elastic stretch cold and still); beyond the stop the
    wires pull against their own elasticity.
    """
    scale = p.area / p.length
    compliance = ((1.0 - austenite) / p.martensite + austenite / p.austenite) / scale
    cold = load.preload / (p.martensite * scale)
    free = p.stroke * austenite + cold
    x = (free - compliance * (load.preload + inertia)) / (1.0 + compliance * load.rate)
    if x > p.stop:
        return p.stop, (free - p.stop) / compliance
    return x, load.preload + load.rate * x + inertia


@kernel
def _excess(
    p: Wire, load: Load, table: Everett, memory: Memory, u: float, inertia: float, latent: float
) -> float:
    """Heat content [K] that belongs to relay input `u`: temperature plus latent share."""
    austenite = peek(table, memory, u)
    _, force = geometry(p, load, austenite, inertia)
    # T = u + shift (F - F_ref): Clausius-Clapeyron
    return u + p.shift * (force - p.reference_load) + latent * austenite


@kernel
def solve(
    p: Wire, load: Load, table: Everett, s: WireState, content: float, inertia: float, latent: float
) -> tuple[Annotated[float, Meaning(name="u")], Annotated[float, Meaning(name="slope")]]:
    """Relay input (deg C) at which the wires hold a heat content, by a bracketed secant search."""
    r_old = _excess(p, load, table, s.memory, s.u, inertia, latent) - content
    if abs(r_old) < 1e-11:
        return s.u, s.slope
    start = r_old
    u_old = s.u
    low = min(s.u, s.u - r_old * 1.0000001)
    high = max(s.u, s.u - r_old * 1.0000001)
    u = s.u - r_old / s.slope
    for k in range(60):
        r = _excess(p, load, table, s.memory, u, inertia, latent) - content
        if abs(r) < 1e-10:
            break
        if r > 0.0:
            high = u
        else:
            low = u
        following = 0.5 * (low + high)
        if r != r_old:
            secant = u - r * (u - u_old) / (r - r_old)
            # Secants that creep along a steep relay are helped by halving the bracket.
            if low < secant < high and (k < PATIENT or k % 2 == 0):
                following = secant
        u_old = u
        r_old = r
        u = following
    slope = s.slope
    if u != s.u:
        slope = max(-start / (u - s.u), 1.0)
    return u, slope


@kernel
def heated(
    p: Wire, load: Load, table: Everett, s: WireState, gain: float, inertia: float, capacity: float
) -> WireState:
    """The wires after taking up heat."""
    latent = p.latent / capacity
    content = s.content + gain / capacity
    u, slope = solve(p, load, table, s, content, inertia, latent)
    memory, austenite = advance(table, s.memory, u)
    x, _ = geometry(p, load, austenite, inertia)
    temperature = content - latent * austenite
    return WireState(content, u, slope, austenite, x, temperature, memory)


@kernel
def placed(s: WireState, x: float) -> WireState:
    """The wires with another contraction: what other wires and creep add."""
    return WireState(s.content, s.u, s.slope, s.austenite, x, s.temperature, s.memory)


@kernel
def tempered(p: Wire, load: Load, table: Everett, s: WireState, temperature: float) -> WireState:
    """The wires at an imposed temperature (deg C), as in the kiln; for slow changes of load."""
    _, force = geometry(p, load, s.austenite, 0.0)
    u = temperature - p.shift * (force - p.reference_load)
    memory, austenite = advance(table, s.memory, u)
    x, _ = geometry(p, load, austenite, 0.0)
    return WireState(temperature, u, s.slope, austenite, x, temperature, memory)
