"""Commissions random axes and writes what came of it into docs/commissioning.md.

    python docs/make_commissioning.py [NUMBER]

Axes are drawn over wide ranges of data-sheet figures (below); what cannot work as an axis is drawn
anew, by the rules that a settings file meets, too. Each is commissioned as a person would do it,
without a look at its figures; then what was found is compared with them. Some ten seconds an axis.
"""

from __future__ import annotations

import math
import re
import sys
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.commission.probing import CommissionError
from macromicro.commission.procedure import Options
from macromicro.commission.running import Commissioned, Place, commission
from macromicro.errors import InputError
from macromicro.machines import axis, rig, sheets
from macromicro.machines.axis import DEFAULT
from macromicro.schema import config

PAGE = Path(__file__).resolve().parent / "commissioning.md"
MEASURED = re.compile(r"(<!-- measured: random -->\n).*?(<!-- end -->)", re.DOTALL)
NUMBER, SEED = 40, 2027
NAMES = ("mass", "viscous", "coulomb")


def drawn(random: np.random.Generator) -> Any:
    """Settings of a random axis that can work."""
    while True:
        try:
            return config.overridden(DEFAULT, _figures(random), "a random axis")
        except InputError:
            continue


def _figures(random: np.random.Generator) -> dict[str, Any]:
    def between(low: float, high: float) -> float:
        return float(np.exp(random.uniform(math.log(low), math.log(high))))

    supply = float(random.choice([12.0, 24.0, 48.0]))
    resistance = between(0.5, 12.0)
    kind = str(random.choice(["belt", "screw", "linear"]))
    constant, force = between(0.01, 0.1), between(5.0, 40.0)
    radius, lead = between(4e-3, 15e-3), between(2e-3, 10e-3)
    current = supply / resistance * between(0.3, 1.5)
    push = {"belt": constant / radius, "screw": constant * 2.0 * math.pi / lead, "linear": force}
    most = push[kind] * min(current, supply / resistance)
    coulomb = most * between(0.02, 0.2)
    travel = between(0.05, 0.4)
    pitch = between(0.2e-6, 20e-6)
    period = float(random.choice([0.25e-3, 0.5e-3, 1e-3]))
    per_turn = 2.0 * math.pi * radius if kind == "belt" else lead
    return {
        "amplifier.mode": "voltage",
        "amplifier.supply": f"{supply!r} V",
        "amplifier.current": f"{current!r} A",
        "motor.constant": f"{constant!r} N*m/A",
        "motor.force": f"{force!r} N/A",
        "motor.resistance": f"{resistance!r} ohm",
        "motor.inductance": f"{resistance * between(0.05e-3, 0.8e-3)!r} H",
        "motor.inertia": f"{between(5e-7, 2e-5)!r} kg*m^2",
        "drive.kind": kind,
        "drive.radius": f"{radius!r} m",
        "drive.lead": f"{lead!r} m",
        "load.mass": f"{between(0.2, 5.0)!r} kg",
        "load.stop_low": f"{-between(0.1, 0.4) * travel!r} m",
        "load.stop_high": f"{travel!r} m",
        "friction.coulomb": f"{coulomb!r} N",
        "friction.stribeck": f"{coulomb * between(0.02, 0.4)!r} N",
        "friction.stribeck_speed": f"{between(1e-3, 30e-3)!r} m/s",
        "friction.viscous": f"{most * between(0.02, 0.3)!r} N*s/m",
        "friction.presliding": f"{between(1e-6, 10e-6)!r} m",
        "friction.ripple": f"{coulomb * between(0.005, 0.08)!r} N",
        "friction.ripple_long": f"{between(20e-3, 80e-3)!r} m",
        "friction.ripple_short": f"{between(5e-3, 20e-3)!r} m",
        "encoder.at": str(random.choice(["motor", "load"])) if kind != "linear" else "load",
        "encoder.lines": max(round(per_turn / pitch / 4.0), 16) * 1.0,
        "encoder.pitch": f"{pitch!r} m",
        "timing.period": f"{period!r} s",
        "timing.delay": f"{random.uniform(0.05, 1.0) * period!r} s",
    }


def truth(tree: Any) -> dict[str, float]:
    """What the model's parameters are, in volts and metres, by the axis' figures."""
    per_newton = sheets.per_newton(tree)
    emf = sheets.constant(tree) / tree.amplifier.gain
    return {
        "mass": per_newton * sheets.mass(tree),
        "viscous": emf + per_newton * tree.friction.viscous,
        "coulomb": per_newton * tree.friction.coulomb,
    }


class Watched(rig.CompiledTwin):
    """The twin, with the farthest places that it came to."""

    def __init__(self, tree: Any, seed: int) -> None:
        super().__init__(axis.KIND, tree, seed)
        self.low = self.high = 0.0

    def _measured(self, t: float) -> float:
        place = super()._measured(t)
        self.low, self.high = min(self.low, place), max(self.high, place)
        return place


def commissioned(tree: Any, seed: int) -> tuple[Commissioned, Watched]:
    """One axis, commissioned; only what a person knows of it is said."""
    made: list[Watched] = []

    def make(seed: int) -> Watched:
        made.append(Watched(tree, seed))
        return made[-1]

    effort = tree.amplifier.full_scale
    place = Place("a random axis", make, tree.timing.period, tree.encoder.pitch, effort, False)
    speed = 0.5
    options = Options(effort, speed, speed / 25.0, 1.0)
    return commission(place, options, seed=seed), made[-1]


def main(number: int) -> None:
    """Commission `number` axes and write the page."""
    random = np.random.Generator(np.random.PCG64(SEED))
    inside = dict.fromkeys(NAMES, 0)
    errors: dict[str, list[float]] = {name: [] for name in NAMES}
    refused: list[str] = []
    unmet: list[str] = []
    done = 0
    for k in range(number):
        tree = drawn(random)
        try:
            found, seen = commissioned(tree, k)
        except (CommissionError, InputError) as error:
            refused.append(f"axis {k}: {error}")
            print(refused[-1], flush=True)
            continue
        done += 1
        true = truth(tree)
        for name in NAMES:
            off = getattr(found.model.axis, name) - true[name]
            inside[name] += abs(off) <= found.model.half_width(name)
            errors[name].append(abs(off) / true[name])
        if not found.verified.met:
            arrived = sum(m.arrived_s is not None for m in found.verified.moves)
            why = found.verified.fault or f"{arrived} of {found.verified.asked} moves arrived"
            unmet.append(f"axis {k}: {why}")
        stops = tree.load.stop_high - tree.load.stop_low
        give = 0.02 * stops
        out = seen.low < tree.load.stop_low - give or seen.high > tree.load.stop_high + give
        words = ", ".join(
            f"{n} {getattr(found.model.axis, n):.3g} +- {found.model.half_width(n):.2g} "
            f"({true[n]:.3g})"
            for n in NAMES
        )
        print(k, words, "verified" if found.verified.met else unmet[-1], out, flush=True)
    lines = ["| parameter | 95 % interval holds the truth | median error |", "|---|---|---|"]
    for name in NAMES:
        share = f"{inside[name]} of {done} ({inside[name] / done:.0%})"
        lines.append(f"| {name} | {share} | {np.median(errors[name]):.2%} |")
    met = done - len(unmet)
    lines += ["", f"All moves of the verification arrived on {met} of {done} ({met / done:.0%})."]
    for title, those in (("Not verified", unmet), ("Refused", refused)):
        lines += ["", f"{title}: {len(those)}." if those else f"{title}: none."]
        lines += [f"* {one}" for one in those]
    text = "\n".join(lines) + "\n"
    print(text)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(MEASURED.sub(lambda m: m[1] + text + m[2], page), encoding="utf-8")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else NUMBER)
