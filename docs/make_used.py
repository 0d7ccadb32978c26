"""Measures what laws ask of motor and wires, beside what those allow, for validation/beyond.md.

    python docs/make_used.py [--quick: write nothing]

Both pairs of laws make the moves of the programme `fast`; the bench's truth tells currents, heat
and temperatures.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import NamedTuple

import beyond
import make_beyond_both
import measured_page
import numpy as np

from macromicro import api
from macromicro.plant.flexure import stiffness
from macromicro.recording import Recording
from macromicro.settings import Settings

PROGRAMME = "fast"
LAWS = make_beyond_both.LAWS
# Dynalloy, Technical Characteristics of Flexinol Actuator Wires (F1140): wires whose current
# contracts them within 1 s, diameter (mm), ohm/m and A; heating pull, MPa; share of the length.
WIRES = ((0.125, 75.0, 0.32), (0.15, 55.0, 0.41))
PULL, STRAIN = 172.0, 4.0


class Row(NamedTuple):
    """A quantity: its name, what is allowed, digits, and how a run tells it."""

    name: str
    allowed: str
    digits: int
    of: Callable[[Recording, Settings], float]


def printed(settings: Settings) -> float:
    """Heat that contracts a wire of this cross-section within 1 s by the table, W/m."""
    area = 1e6 * settings.bench.wire.area
    (a, b) = ((0.25 * np.pi * d * d, ohm * amps * amps) for d, ohm, amps in WIRES)
    return float(np.interp(area, [a[0], b[0]], [a[1], b[1]]))


def density(run: Recording, settings: Settings) -> np.ndarray:
    """Heat per length of the wires, W/m."""
    return np.asarray(run["true_heat"]) / settings.bench.wire.length


def longest(busy: np.ndarray, dt: float) -> float:
    """Longest time without a break, s."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], busy.astype(int), [0]))))
    return float((edges[1::2] - edges[::2]).max() * dt) if len(edges) else 0.0


def pull(run: Recording, settings: Settings) -> float:
    """Greatest stress of the wires, MPa."""
    b = settings.bench
    rate = b.bias.rate + stiffness(b.flexure)
    way = 1e-3 * float(np.max(run["true_micro"]))
    return 1e-6 * (b.bias.preload + rate * way) / b.wire.area


def strained(run: Recording, settings: Settings) -> float:
    """Greatest contraction, % of the wires' length."""
    return 1e-1 * float(np.max(run["true_micro"])) / settings.bench.wire.length


def rows(settings: Settings) -> tuple[Row, ...]:
    """What is looked at on a bench."""
    full, heat = settings.bench.amplifier.full_scale, printed(settings)
    guard = settings.guard
    return (
        Row("motor's effort, largest [V]", f"{full:g}", 2, lambda r, _: _most(r, "motor")),
        Row("motor's current, largest [A]", "-", 2, lambda r, _: _most(r, "true_current")),
        Row("the same, RMS while it drives [A]", "-", 2, lambda r, _: _driving(r)),
        Row("CTRL, largest [V]", f"{guard.ctrl:g}", 2, lambda r, _: _most(r, "ctrl")),
        Row("heat per length, largest [W/m]", "-", 1, lambda r, s: float(density(r, s).max())),
        Row(f"longest above the table's {heat:.1f} W/m [s]", "1", 2,
            lambda r, s: longest(density(r, s) > heat, r.dt)),
        Row("mean heat per length [W/m]", f"{heat:.1f}", 1,
            lambda r, s: float(density(r, s).mean())),
        Row("wires, hottest [degC]", f"{guard.hottest:g}", 0, lambda r, _: _most(r, "true_wire")),
        Row("stress of the wires, largest [MPa]", f"{PULL:g}", 0, pull),
        Row("contraction, largest [% of their length]", f"{STRAIN:g}", 1, strained),
    )  # fmt: skip


def _most(run: Recording, name: str) -> float:
    return float(np.max(np.abs(run[name])))


def _driving(run: Recording) -> float:
    current = run["true_current"][np.abs(run["motor"]) > 0.0]
    return float(np.sqrt(np.mean(current**2)))


def used_table(settings: Settings) -> str:
    """The table."""
    runs = [api.run(PROGRAMME, settings=beyond.under(settings, law)) for law in LAWS]
    lines = [
        [row.name, row.allowed, *(f"{row.of(run, settings):.{row.digits}f}" for run in runs)]
        for row in rows(settings)
    ]
    return measured_page.table(["", "allowed", *(n.replace(",", " and ") for n in LAWS)], lines)


if __name__ == "__main__":
    table = used_table(Settings())
    if "--quick" not in sys.argv:
        measured_page.put(beyond.PAGE, "used", table)
