"""The micro-stage alone: where it begins and stops, and P, PI and anti-windup control.

Sections 5.2.2 and 5.3, Figures 5.10, 5.19, 5.20, 5.22, 5.23 and 5.25 to 5.27. Positions
come from the laser, which no controller sees.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.design.response import smoothed
from macromicro.lab.drive import heated
from macromicro.lab.machine import Machine
from macromicro.programme import Programme
from macromicro.recording import Recording
from macromicro.runs.programmed import Runner, moves_of
from macromicro.runs.sequence import BAND_UM, LEVELS, TIMES, micro_steps
from macromicro.settings import Settings
from macromicro.thesis.chapter5 import electrothermal_runs

BELOW_STOP = (1.5, 1.55, 1.575, 1.6)
AT_STOP = (1.65,)
ABOVE_STOP = (1.675, 1.7, 1.8, 1.9)
FIRST_RESPONSE = tuple(float(v) for v in np.round(np.arange(1.26, 1.521, 0.02), 2))
RESPONDS_UM = 20.0
GAINS = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
INTEGRAL_GAINS = (0.5, 0.75, 1.0, 1.25, 1.5, 2.25, 3.0, 4.5)
# With anti-windup, where Ki = Kaw: on the sequence, and on the step to 3.8 mm.
FIRST_GAINS = (2.25, 10.0)
HELD_BACK_GAINS = (5.0, 10.0, 20.0, 30.0, 40.0, 60.0, 100.0)
TARGET_MM = 3.8
HOLDS = (0.3, 0.8, 1.3, 1.8, 2.3, 2.8, 3.3, 3.8, 3.1, 2.4, 1.7, 1.0, 0.3, 2.0, 3.8, 0.5)  # mm
_MEAN = 21  # samples of the centred mean that takes the laser's fast noise


class MicroRuns(NamedTuple):
    """Recordings. `steps`: open loop, by CTRL [V] (Figure 5.10); `feet`: the same at low CTRL.

    `proportional`, `integral`, `held_back`: steps to 3.8 mm by Kp [V/mm], by Ki [V/(mm s)] at
    Kp 3, and by Ki = Kaw with anti-windup; `pi`, `antiwindup`: the sequence 0 - 2 - 3 - 2 -
    0 mm; `gentle`: the same with anti-windup and lower Ki = Kaw; `held`: 16 levels, by seed.
    """

    steps: dict[float, Recording]
    feet: dict[float, Recording]
    proportional: dict[float, Recording]
    integral: dict[float, Recording]
    held_back: dict[float, Recording]
    pi: Recording
    antiwindup: Recording
    gentle: dict[float, Recording]
    held: list[Recording]
    settings: Settings


def collect(base: Settings, seed: int, run: Runner, machine: Machine) -> MicroRuns:
    """The whole procedure; `run` drives the closed loops, `machine` runs in open loop."""

    def opened(volts: float, seconds: float) -> Recording:
        ctrl = electrothermal_runs.step(volts, seconds)
        return heated(machine, ctrl, seed, 10 if seconds > 30.0 else 1)

    def closed(law: str, levels: Sequence[float], hold: float, **gains: float) -> Recording:
        return run(micro_steps(levels, hold), with_law(base, law, **gains), seed, False)

    def sequence(law: str, **gains: float) -> Recording:
        return run(micro_steps(LEVELS, 2.0, TIMES), with_law(base, law, **gains), seed, False)

    top, best = [1e-3 * TARGET_MM], "pi-antiwindup"
    return MicroRuns(
        steps={v: opened(v, 200.0) for v in BELOW_STOP}
        | {v: opened(v, 20.0) for v in AT_STOP + ABOVE_STOP},
        feet={v: opened(v, 60.0) for v in FIRST_RESPONSE},
        proportional={k: closed("p", top, 6.0, kp=1e3 * k) for k in GAINS},
        integral={k: closed("pi", top, 15.0, ki=1e3 * k) for k in INTEGRAL_GAINS},
        held_back={k: closed(best, top, 6.0, ki=1e3 * k, kaw=k) for k in HELD_BACK_GAINS},
        pi=sequence("pi"),
        antiwindup=sequence(best),
        gentle={k: sequence(best, ki=1e3 * k, kaw=k) for k in FIRST_GAINS},
        held=[run(_holds(), with_law(base, best), seed + k, False) for k in range(3)],
        settings=base,
    )


def _holds() -> Programme:
    return micro_steps([1e-3 * level for level in HOLDS])


def with_law(settings: Settings, law: str, **gains: float) -> Settings:
    field = law.replace("-", "_")
    changed = getattr(settings.controller, field)._replace(**gains)
    controller = settings.controller._replace(micro_law=law)._replace(**{field: changed})
    return settings._replace(controller=controller)


def highest(recording: Recording) -> float:
    """Largest contraction [mm] by the laser, averaged over 21 samples."""
    return float(smoothed(recording["laser"], _MEAN).max()) * 1e-3


def first_response(feet: dict[float, Recording]) -> float:
    """Lowest CTRL [V] that moves the stage by more than 20 um within its minute; NaN if none."""
    moved = [v for v, r in sorted(feet.items()) if 1e3 * highest(r) > RESPONDS_UM]
    return moved[0] if moved else float("nan")


class Swing(NamedTuple):
    """Step under P control: final error and overshoot of the rest [um], ripple of CTRL [V]."""

    error: float
    overshoot: float
    ripple: float


def swing(recording: Recording, target: float = TARGET_MM) -> Swing:
    """A step to `target` [mm] without its first 0.2 s; NaN for a run that the guard ended."""
    if not recording.attributes.get("finished", 1):
        return Swing(*[float("nan")] * 3)
    place, rest = smoothed(recording["laser"][:-1], _MEAN), recording["laser"][-1001:-1].mean()
    effort = smoothed(recording["ctrl"][:-1], _MEAN)[200:-_MEAN]
    path = float(np.abs(np.diff(effort)).sum() - abs(effort[-1] - effort[0]))
    return Swing(float(1e3 * target - rest), float(place.max() - rest), path)


def chosen_gain(swings: dict[float, Swing]) -> float:
    """The rule of Section 5.3.1: the largest Kp that overshoots its rest by at most 10 um."""
    return max((k for k, s in swings.items() if s.overshoot <= BAND_UM), default=float("nan"))


def integral_overshoot(recording: Recording) -> float:
    """Highest integral effort [V] above its mean over the last second."""
    effort = recording["micro_integral"][:-1]
    return float(effort.max() - effort[-1000:].mean())


def chosen_integral_gain(integral: dict[float, Recording]) -> float:
    """The largest Ki whose integral effort overshoots its last value by less than 1 %."""
    calm = [
        k
        for k, r in integral.items()
        if r.attributes.get("finished", 1)
        and integral_overshoot(r) <= 0.01 * r["micro_integral"][-1001:-1].mean()
    ]
    return max(calm, default=float("nan"))


def unrest(recording: Recording) -> float:
    """Peak to peak [V] of the detrended integral effort over the last 3 s, or NaN."""
    if not recording.attributes.get("finished", 1):
        return float("nan")
    late = recording["micro_integral"][-round(3.0 / recording.dt) - 1 : -1]
    at = np.arange(len(late))
    return float(np.ptp(late - np.polyval(np.polyfit(at, late, 1), at)))


def error_after(recording: Recording, step: float) -> float:
    """Reference minus laser [um] 1 s after a step at `step` [s], mean of 21 samples."""
    k = round((step + 1.0) / recording.dt)
    if k + _MEAN // 2 >= len(recording):
        return float("nan")
    seen = float(recording["laser"][k - _MEAN // 2 : k + _MEAN // 2 + 1].mean())
    return 1e3 * float(recording["micro_reference"][k]) - seen


def undershoot(recording: Recording, step: float) -> float:
    """Drop of the integral effort [V] below its value at the end of a hold of 2 s, or NaN."""
    a, b = (round(t / recording.dt) for t in (step, step + 2.0))
    if b > len(recording):
        return float("nan")
    part = recording["micro_integral"][a : b - 1]
    return float(part[-1] - part.min())


def hold_errors(runs: MicroRuns) -> Array:
    """Level [mm] and error [um] of every hold over its last 0.5 s, shape (2, holds), or NaN."""
    programme = _holds()
    found = [m for r in runs.held for m in moves_of(r, programme, runs.settings)]
    errors = [float("nan") if m.final_error is None else m.final_error for m in found]
    return np.array([[1e-3 * m.target for m in found], errors])


def worst_hold(runs: MicroRuns) -> float:
    """Largest error [um] of a hold; NaN unless all were completed."""
    errors = np.abs(hold_errors(runs)[1])
    return float(errors.max()) if len(errors) == len(HOLDS) * len(runs.held) else float("nan")
