"""Gains of an axis: tolerance by rehearsal, margins on drawn machines, and a search."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.commission import _verifying, margins
from macromicro.commission._axis_fit import Model
from macromicro.commission.margins import DRAWS, SEED, Robust
from macromicro.commission.procedure import Robustness, Tuned
from macromicro.machines import loops, planning, results, runs, sheets
from macromicro.machines import machine as machines
from macromicro.machines.loops import Complex
from macromicro.programme import Programme
from macromicro.schema.par import entries, value_at
from macromicro.tuning.search import Budget, Tuning, search
from macromicro.tuning.stage import Stage
from macromicro.tuning.subject import Figures

# With friction and a lag in the loop, a slow axis with a fine encoder hunts about its target. Moves
# are simulated with drawn presliding friction, and the tolerance is the finest at which all arrive.

SHARES = (0.3, 0.32, 0.7, 0.1)  # of the travel; others than those of the verification
HOLD = 0.1  # s
SPREAD = (0.5, 2.0)  # times the give before sliding, and the speed over which friction fades
WAIT = 0.5  # of the patience: what arrives later on the model may be late on the axis
COARSER = 1.4  # from one tolerance that is tried to the next
TRIES = 14  # up to some hundred times the finest


def programme(settings: Any) -> Programme:
    """Test moves, in counts."""
    return _verifying.test_moves("rehearsal", "moves on the model", SHARES, HOLD, settings)


def drawn_friction(settings: Any) -> Iterator[Any]:
    """The machine with other presliding friction under the same law."""
    friction = settings.friction
    for give in SPREAD:
        for fading in SPREAD:
            changed = friction._replace(
                presliding=give * friction.presliding,
                stribeck_speed=fading * friction.stribeck_speed,
            )
            yield settings._replace(friction=changed)


def arrives(machine: machines.Machine, settings: Any) -> bool:
    """Whether all moves arrive in time on all drawn machines."""
    what = programme(settings)
    plan, latest = planning.plan(what, settings), WAIT * settings.arrival.patience
    for seed, tree in enumerate(drawn_friction(settings)):
        done = runs.record(machine, tree, plan, seed=seed, warn=False)
        if done.outcome.fault is not None:
            return False
        made = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
        took = results.settling(made)
        if len(took) < len(SHARES) or max(took) > latest:
            return False
    return True


def settling_time(machine: machines.Machine, settings: Any) -> float | None:
    finest = float(settings.arrival.tolerance)
    for k in range(TRIES):
        tolerance = finest * COARSER**k
        tried = settings._replace(
            arrival=settings.arrival._replace(tolerance=tolerance),
            controller=settings.controller._replace(rest=0.5 * tolerance),
        )
        if arrives(machine, tried):
            return tolerance if k else None
    return None


_SLOWEST = 1e-3  # of the velocity loop's bandwidth: far below all poles but those at 0
_EVERY = 2  # of the frequencies that a loop is looked at
_POLES = 2  # of the open loop at 0


def drawn_machines(settings: Any, model: Model, number: int, seed: int = SEED) -> Iterator[Any]:
    """Machines within the uncertainty of the linear loop."""
    random, mode = np.random.Generator(np.random.PCG64(seed)), model.limber
    off = dict.fromkeys(("resonance", "damping", "lag"), 0.0) | (
        {} if mode is None else mode.errors
    )
    mean = np.array([getattr(model.axis, name) for name in model.names])
    for row in random.multivariate_normal(mean, model.covariance, number, method="svd"):
        values = dict(zip(model.names, row, strict=True))
        heavier = max(values["mass"] / model.axis.mass, 0.01)
        rubs = values["viscous"] - model.axis.viscous
        late = values.get("lag", model.axis.lag) - model.axis.lag
        resonance, damping, lag = (one * random.standard_normal() for one in off.values())
        load, motor, drive = settings.load, settings.motor, settings.drive
        friction, timing = settings.friction, settings.timing
        stiffer = 1.0 if mode is None else 1.0 + resonance / mode.shape.resonance
        yield settings._replace(
            load=load.times(heavier),
            motor=motor._replace(inertia=heavier * motor.inertia),
            drive=drive._replace(
                inertia=heavier * drive.inertia,
                frequency=max(stiffer, 0.1) * drive.frequency,
                damping=max(drive.damping + damping, 0.0),
            ),
            friction=friction._replace(viscous=friction.viscous + rubs),
            timing=timing._replace(delay=max(timing.delay + late + lag, 0.0)),
        )


def robust(settings: Any, model: Model, number: int = DRAWS) -> Robust:
    frequency, law = _law_response(settings, model)
    every = (sheets.plant(one, frequency) * law for one in drawn_machines(settings, model, number))
    return margins.robust(frequency, sheets.plant(settings, frequency) * law, every)


def keeps(settings: Any, model: Model, each: Iterable[Any], modulus: float) -> bool:
    """Whether the loop is stable on all machines with at least the given modulus margin."""
    frequency, law = _law_response(settings, model)
    loop = (sheets.plant(one, frequency) * law for one in each)
    return all(loops.modulus(one, _POLES) >= modulus for one in loop)


def _law_response(made: Any, model: Model) -> tuple[Array, Complex]:
    """Frequencies from far below the bandwidth, and the law's response."""
    dt, bandwidth = made.timing.period, made.controller.velocity / model.axis.mass
    frequency = loops.grid(dt, _SLOWEST * bandwidth)[::-_EVERY][::-1]
    return frequency, loops.law(made.controller, frequency, dt)


def robustness(settings: Any, model: Model) -> Robustness:
    return margins.as_robustness(robust(settings, model), "strokes over a longer travel")


OBJECTIVE = "settling"
LEAST = 0.5  # distance of the loop from -1: a peak of its sensitivity of 2
_EVALUATIONS = 80
_LOOKED = 20  # drawn models on which a design is looked at
_SPARE = 1.06  # times the margin that all drawn models must keep


def models(settings: Any, model: Model) -> Iterator[Any]:
    """Axes within the uncertainty, with different presliding friction."""
    others = list(drawn_friction(settings))
    for one, other in zip(drawn_machines(settings, model, len(others)), others, strict=True):
        friction = other.friction._replace(viscous=one.friction.viscous)
        yield one._replace(friction=friction)


def search_gains(
    settings: Any, model: Model, progress: Callable[[int, float], None] = lambda done, best: None
) -> Tuned:
    """Gains that settle faster than those by the rules, if any."""
    # The slowest move over the model and `models` counts. A design is feasible if its modulus
    # margin is at least `LEAST`, or that of the rules, on any drawn model.
    place = places.of(settings)
    machine = machines.named("rotary" if place.turns else "axis", "machine")
    if settings.law != machine.law.name:
        return Tuned()
    least = min(LEAST, robust(settings, model).least.modulus)

    few = tuple(drawn_machines(settings, model, _LOOKED))  # gains do not change them

    def allowed(tree: Any) -> bool:
        return keeps(tree, model, few, _SPARE * least)

    subject = Stage(machine, settings, planning.plan(programme(settings), settings), allowed)
    budget = Budget(_EVALUATIONS, named=tuple(models(settings, model)))
    found = search(subject, OBJECTIVE, {}, budget, progress)

    def worst(each: list[Figures]) -> float:
        return max(map(found.objective.value, each))

    before, after = worst(found.first.runs), worst(found.best.runs)
    if not _verifying.is_better(after, before):
        return Tuned()
    drawn = drawn_machines(settings, model, margins.DRAWS)
    if not keeps(found.best.settings, model, drawn, least):
        return Tuned()
    return as_tuned(settings, found, before, after)


def as_tuned(settings: Any, found: Tuning, before: float, after: float) -> Tuned:
    units = {e.path: e.par.unit for e in entries(settings)}
    paths, best = found.subject.paths, found.best.settings
    gains = {p: f'"{value_at(best, p)!r} {units[p]}"' for p in paths}
    rule = f"{1e3 * before:.4g} ms by the rules"
    rows = [("settling on the worst model", f"{1e3 * after:.4g}", rule, "ms")]
    for path in paths:
        rule = f"{value_at(settings, path):.4g} {units[path]} by the rules"
        rows.append((path, f"{value_at(best, path):.4g}", rule, units[path]))
    return Tuned(gains, tuple(rows))
