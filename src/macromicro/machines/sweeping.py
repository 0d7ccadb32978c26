"""Measured frequency response of a stage under its law: a sine is added to the law's effort.

The stage slides at constant speed; a second run with the sine's sign reversed cancels friction
ripple. From phasors of law (W), effort (U) and position (Y): plant Y / U, law -W / Y, open loop
-W / U.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from macromicro import joining
from macromicro.arrays import Array
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError, ProblemError
from macromicro.kernel import compiled
from macromicro.machines import guarding, tree
from macromicro.machines.guarding import OK
from macromicro.machines.machine import Machine
from macromicro.machines.signals import Sample, Target
from macromicro.machines.stage import Kind, compiles
from macromicro.rig.twin import noise_source

Complex = npt.NDArray[np.complex128]

SETTLE = 0.15  # s; and a cycle, before a window begins
CYCLES = 4  # in a window, at least
LEAST = 0.3  # s; and at least so long
FULL = 0.99  # of the guard's limit of the effort: from there on nothing is linear
SHARE = 0.3  # of speed, of the moves' acceleration and of the effort's limit, that a sine takes


class Response(NamedTuple):
    """Measured response over rising frequencies."""

    frequency: Array  # Hz
    plant: Complex  # position per effort, m/V
    law: Complex  # effort per position error, V/m
    loop: Complex  # open loop, without its sign
    moved: Array  # amplitude of the position, m: where it is a fraction of a count, points scatter


@lru_cache(maxsize=64)
def excitation_loop(kind: Kind, law: StageLaw) -> Callable[..., int]:
    """The loop of a stage with an excitation added to its effort."""
    measure, advance, step = kind.measure, kind.advance, law.step
    joining.join(measure, advance, step)

    def run(  # noqa: PLR0913, PLR0917 - of one caller, and compiled
        params: Any,
        stage: Any,
        gains: Any,
        memory: Any,
        limits: Any,
        watch: Any,
        targets: Array,
        added: Array,
        noise: Array,
        out: Array,
        dt: float,
    ) -> int:
        for k in range(added.shape[0]):
            sample = measure(params, stage, k * dt, noise, k)
            target = Target(targets[k, 0], targets[k, 1], targets[k, 2], math.inf)
            memory, wanted = step(gains, memory, target, sample, dt)
            both = min(max(wanted + added[k], -limits.effort), limits.effort)
            watch, effort = guarding.step(limits, watch, sample, target, both)
            out[0, k] = sample.position
            out[1, k] = wanted
            out[2, k] = effort
            if watch.fault != OK:
                break
            stage = advance(params, stage, effort, noise, k, dt)
        return int(watch.fault)

    return run


def frequencies(low: float, high: float, count: int, dt: float) -> Array:
    """Frequencies whose whole cycles fill whole periods."""
    if not 0.0 < low < high <= 0.45 / dt:
        remedy = f"Let them rise from above 0 to at most {0.45 / dt:g} Hz."
        raise ProblemError("frequencies", f"they go from {low:g} to {high:g} Hz", remedy)
    if count < 2:
        raise InputError("frequencies", count, "2 or more")
    wanted = np.geomspace(low, high, count)
    cycles = np.array([_cycles(f) for f in wanted])
    return np.unique(cycles / (np.round(cycles / (wanted * dt)) * dt))


def _cycles(frequency: float) -> int:
    return max(CYCLES, math.ceil(LEAST * frequency))


def _window(frequency: float, dt: float) -> int:
    """Periods that hold whole cycles of such a frequency."""
    near = _cycles(frequency) + np.array([0, -1, 1])
    periods = near / (frequency * dt)
    return int(np.round(periods[np.argmin(np.round(np.abs(periods - np.round(periods)), 6))]))


def measure_response(
    machine: Machine,
    settings: Any,
    frequency: Array,
    model: Callable[[Array], Complex],
    *,
    seed: int = 0,
    progress: Callable[[int, int], None] = lambda done, count: None,
) -> Response:
    """Measure the response of a simulated machine."""
    if not compiles(machine.law):
        raise InputError("law", machine.law.name, "a law whose `step` is a kernel (docs/laws.md)")
    dt = settings.timing.period
    rows = []
    random = noise_source(seed)
    for k, f in enumerate(frequency.tolist()):
        targets, added, window = _course(settings, f, abs(complex(model(np.array([f]))[0])))
        noise = random.standard_normal((2, len(added), machine.kind.noises))
        ran = [_run(machine, settings, targets, sign * added, noise[j]) for j, sign in _BOTH]
        for out, fault in ran:
            said = guarding.TEXTS[fault].message if fault != OK else ""
            if not said and np.max(np.abs(out[2])) >= FULL * settings.guard.effort:
                said = "the effort reaches its limit"
            if said:
                problem = said[0].lower() + said[1:]
                remedy = "The loop must be stable and stay within the limits of guard and effort."
                raise ProblemError(f"response at {f:.4g} Hz", problem, remedy)
        rows.append([_phasor(row[window], f, dt) for row in ran[0][0] - ran[1][0]])
        progress(k + 1, len(frequency))
    place, wanted, whole = np.array(rows).T
    return Response(frequency, place / whole, -wanted / place, -wanted / whole, abs(place) / 2.0)


_BOTH = ((0, 1.0), (1, -1.0))


def _run(
    machine: Machine, settings: Any, targets: Array, added: Array, noise: Array
) -> tuple[Array, int]:
    """Rows of `excited` over a course, and the guard's fault."""
    kind, law, out = machine.kind, machine.law, np.empty((3, len(added)))
    params, gains = kind.prepare(settings), tree.gains(settings)
    fault = compiled(excitation_loop(kind, law))(
        params,
        kind.initial(params),
        gains,
        law.start(gains, Sample(0.0, 0.0)),
        settings.guard,
        guarding.fresh(),
        targets,
        added,
        noise,
        out,
        settings.timing.period,
    )
    return out, fault


def _course(settings: Any, f: float, gain: float) -> tuple[Array, Array, slice]:
    """Targets at constant speed, the excitation, and the window of whole cycles."""
    dt, motion = settings.timing.period, settings.motion
    wait = math.ceil((SETTLE + 1.0 / f) / dt)
    length = _window(f, dt)
    slow = 0.3 * motion.acceleration
    whole = (wait + length) * dt
    # The way of ramp and travel is 0.8 of what there is at most: v whole + v^2 / 2 a.
    way = 0.8 * settings.travel.high
    speed = slow * (math.sqrt(whole * whole + 2.0 * way / slow) - whole)
    speed = min(speed, 0.5 * motion.velocity)
    ramp = math.ceil(speed / (slow * dt))
    count = ramp + wait + length
    t = np.arange(count) * dt
    end = ramp * dt
    velocity = np.minimum(t / end, 1.0) * speed
    place = np.where(t < end, 0.5 * speed * t * t / end, 0.5 * speed * end + speed * (t - end))
    targets = np.column_stack((place, velocity, np.where(t < end, speed / end, 0.0)))
    w, gain = 2.0 * math.pi * f, max(gain, 1e-30)
    amplitude = min(
        SHARE * speed / (w * gain),
        SHARE * motion.acceleration / (w * w * gain),
        SHARE * settings.guard.effort,
    )
    since = t - end
    added = np.where(since >= 0.0, amplitude * np.sin(2.0 * math.pi * f * since), 0.0)
    return np.ascontiguousarray(targets), added, slice(ramp + wait, count)


def _phasor(values: Array, f: float, dt: float) -> complex:
    """Phasor of a detrended row over whole cycles."""
    t = np.arange(len(values)) * dt
    line = np.polynomial.Polynomial.fit(t, values, 1)
    turned = (values - line(t)) * np.exp(-2j * math.pi * f * t)
    return complex(2.0 * turned.mean())
