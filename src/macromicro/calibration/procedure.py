"""The whole calibration of a machine: measure, fit, correct, verify by an independent run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from datetime import date
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.calibration import efforts, fitting, iso, measuring, reversals, targets
from macromicro.calibration.fitting import Fit
from macromicro.calibration.measuring import Readings
from macromicro.calibration.references import Instrument
from macromicro.calibration.reversals import Turning
from macromicro.control.cascade import Cascade
from macromicro.control.correction import Correction
from macromicro.machines import composite, correcting, sheets, tree
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.machine import Machine
from macromicro.rig.session import Fixture

POSITIONS, CHECKED = 40, 17  # along an axis; of a verification
CHECK_RUNS = 3
PROMISED = 0.95  # of the positions, within the half width
PATIENCE = 1.0  # s in which a law must overcome friction at the least error that it corrects
COUNT = 0.6  # counts; one of them always lies so near a set point
_PASSES = 3  # slow passes: as it is, and corrected once and again: the last one only judges
_FARTHER = 1.2  # a push, than the scatter seen

Tell = Callable[[str], Callable[[int, int], None] | None]  # a step's title to its progress


class Request(NamedTuple):
    """What is calibrated, and how."""

    machine: AnyMachine
    settings: Any
    reference: Instrument
    positions: int = POSITIONS  # along each axis
    runs: int = targets.RUNS
    seed: int = 0
    periods: tuple[float, ...] = ()  # m, at which errors may repeat, beside those of the drive
    cogging: bool = False  # whether efforts along the travel are learned as well
    reversals: bool = False  # whether efforts where a motion turns back are
    bench: Any = None  # settings of the simulated machine where the laws know others
    rigs: tuple[Fixture, ...] | None = None  # one a stage; None: the simulated machine


class Axis(NamedTuple):
    """One stage before and after."""

    name: str  # "" of the only stage
    fit: Fit
    correction: Any
    before: iso.Means
    after: iso.Means


class Ripple(NamedTuple):
    """RMS deviation of the speed of a slow pass, before and after."""

    before: float  # m/s
    after: float


class Calibration(NamedTuple):
    request: Request
    settings: Any  # with the corrections
    axes: tuple[Axis, ...]
    before: Readings  # as it is
    measured: Readings  # with the backlash taken up: what the corrections are fitted to
    verified: Readings  # with the corrections, at other positions
    remarks: tuple[str, ...]
    ripple: tuple[Ripple, ...] = ()
    turns: tuple[Turning, ...] = ()

    @property
    def reference(self) -> str:
        """What the positions were compared with, in words."""
        if self.measured is self.before:
            return "readings of another instrument"
        return self.request.reference.title if self.request.rigs is None else "channel of the rig"


def calibrate(request: Request, tell: Tell = lambda title: None) -> Calibration:
    """Measure, fit and verify a machine."""
    machine, settings = without_corrections(request.machine, request.settings)
    random = np.random.default_rng([request.seed, 1])
    visits = _visits(machine, settings, request.positions, request.runs, random)
    before = _measure(machine, settings, visits, request, 0, tell("as it is"))
    machine, settings = pushing(machine, settings, before, request.periods)
    measured = _measure(machine, settings, visits, request, 500, tell("backlash taken up"))
    fits = fit_corrections(machine, settings, measured, request.periods)
    machine, settings = with_corrections(machine, settings, [f.correction for f in fits.values()])
    verified = verify(machine, settings, request, tell("verifying"))
    found = judge(request, machine, settings, fits, (before, measured, verified))
    found = with_efforts(found) if request.cogging else found
    return with_reversals(found) if request.reversals else found


def from_readings(request: Request, given: Readings) -> Calibration:
    """A calibration from readings of another instrument, which no run has verified."""
    machine, settings = without_corrections(request.machine, request.settings)
    fits = fit_corrections(machine, settings, given, request.periods)
    _, settings = with_corrections(machine, settings, [f.correction for f in fits.values()])
    left = np.stack([fit.scatter for fit in fits.values()], axis=1)
    after = given._replace(reference=given.target + left)
    found = judge(request, machine, settings, fits, (given, given, after))
    words = 'not verified: "after" is what the correction leaves of the same readings'
    return found._replace(remarks=(*found.remarks, words))


def with_efforts(found: Calibration) -> Calibration:
    """A calibration that also knows the efforts along the travel."""
    settings, ripple, remarks = learned_efforts(found.request, found.settings)
    return found._replace(settings=settings, remarks=(*found.remarks, *remarks), ripple=(ripple,))


def with_reversals(found: Calibration) -> Calibration:
    """A calibration that also knows the efforts where a motion turns back."""
    request = found.request
    assert isinstance(request.machine, Composite)
    what = (request.seed, request.bench, request.rigs)
    settings, turns = reversals.learn(request.machine, found.settings, *what)
    each = zip(composite.names(request.machine), turns, strict=True)
    remarks = [
        f"axis {name}: nothing to learn where its motion turns back"
        for name, turn in each
        if turn.after >= turn.before
    ]
    return found._replace(settings=settings, turns=turns, remarks=(*found.remarks, *remarks))


def learned_efforts(request: Request, settings: Any) -> tuple[Any, Ripple, tuple[str, ...]]:
    """Settings that know the efforts along the travel, from slow passes."""
    made, own = measuring.ready(request.machine, settings)
    assert isinstance(made, Machine)
    correction, learned, seen = own.correction, own, []
    for k in range(_PASSES):
        seen.append(efforts.passes(made, learned, request.seed + k, request.bench, request.rigs))
        if k + 1 < _PASSES:
            changes = efforts.fit(seen[-1], correction.low, correction.high, drive_periods(own))
            _, learned = with_corrections(made, own, [correction._replace(**changes)])
    ripple = Ripple(seen[0].ripple, seen[-1].ripple)
    if ripple.after < ripple.before:
        return learned, ripple, ()
    words = "no effort repeats along the travel: nothing to learn from slow passes"
    return settings, ripple, (words,)


def intent(request: Request) -> str:
    """What will move, for a person who agrees to it."""
    machine, trees = request.machine, request.machine.trees(request.settings)
    ways = []
    for name, place, own in zip(
        composite.names(machine), composite.places(machine), trees, strict=True
    ):
        low, high = place.told(own.travel.low), place.told(own.travel.high)
        ways.append(f"{f'axis {name}: ' if name else ''}between {low} and {high}")
    circles = " and circles at full speed" if request.reversals else ""
    return (
        f"calibration: {request.positions} positions, {request.runs} runs up and down, 3 times"
        f"{circles}; {'; '.join(ways)}"
    )


def pushing(
    machine: AnyMachine, settings: Any, before: Readings, periods: tuple[float, ...]
) -> tuple[AnyMachine, Any]:
    """The machine with a provisional backlash, so that its drive ends each move on one flank.

    Where a load comes to rest within the backlash is chance. The scatter of that shows how far the
    drive must push at least.
    """
    fits, provisional = fit_corrections(machine, settings, before, periods), []
    for fit, own in zip(fits.values(), machine.trees(settings), strict=True):
        farthest = float(np.max(np.abs(fit.apart))) if correcting.load(own).runs_ahead else 0.0
        half = _FARTHER * farthest
        provisional.append(Correction(up=(-half, -half), down=(half, half)))
    finer = [_finer(own) for own in machine.trees(settings)]
    settings = composite.with_trees(machine, settings, finer)
    return with_corrections(machine, settings, provisional)


def _finer(own: Any) -> Any:
    """Settings whose law corrects errors at rest down to about one count of the sensor."""
    gains, fine = tree.gains(own), COUNT * float(own.encoder.pitch)
    if not isinstance(gains, Cascade) or not gains.rest > fine:
        return own
    # How long the law takes to turn its effort against friction, at an error of so little.
    quick = gains.velocity * gains.integral * gains.position * fine
    if 2.0 * gains.ahead_friction > PATIENCE * quick:
        return own
    return own._replace(**{tree.gains_set(own): gains._replace(rest=fine)})


def verify(
    machine: AnyMachine,
    settings: Any,
    request: Request,
    progress: Callable[[int, int], None] | None = None,
) -> Readings:
    """Measure a machine at positions that no calibration has used."""
    random = np.random.default_rng([request.seed, 2])
    visits = _visits(machine, settings, min(CHECKED, request.positions), CHECK_RUNS, random)
    return _measure(machine, settings, visits, request, 1000, progress)


def _measure(
    machine: AnyMachine,
    settings: Any,
    visits: targets.Visits,
    request: Request,
    step: int,
    progress: Callable[[int, int], None] | None,
) -> Readings:
    """Readings at some positions, each step of the calibration with noise of its own."""
    seed = request.seed + step
    machine, settings = measuring.ready(machine, settings)
    if request.rigs is None:
        how: dict[str, Any] = {"bench": request.bench, "seed": seed, "progress": progress}
        return measuring.measure(machine, settings, visits, request.reference, **how)
    return measuring.on_rigs(machine, settings, visits, request.rigs, seed=seed, progress=progress)


def judge(
    request: Request,
    machine: AnyMachine,
    settings: Any,
    fits: dict[str, Fit],
    readings: tuple[Readings, Readings, Readings],
) -> Calibration:
    """A calibration with its figures and the half widths of its positions."""
    axes: list[Axis] = []
    first, _, verified = readings
    for k, name in enumerate(composite.names(machine)):
        before, after = (
            iso.means(r.target[:, k], r.direction, r.deviation[:, k]) for r in (first, verified)
        )
        half = half_width(verified.deviation[:, k])
        made = date.today().isoformat()
        own = machine.trees(settings)[k].correction._replace(half_width=half, made=made)
        axes.append(Axis(name, fits[name], own, before, after))
    _, settings = with_corrections(machine, settings, [axis.correction for axis in axes])
    return Calibration(request, settings, tuple(axes), *readings, tuple(remarks(axes)))


def half_width(deviation: Array) -> float:
    """Half width that 95 of 100 positions keep: a quantile, whatever the deviations' distribution.

    It is the expected one of all positions, so of fewer than 19 readings the greatest.
    """
    found = np.quantile(np.abs(deviation), PROMISED, method="weibull")
    return float(f"{float(found):.4g}")


def remarks(axes: list[Axis]) -> list[str]:
    found = []
    for axis in axes:
        whose = f"axis {axis.name}: " if axis.name else ""
        before, after = iso.figures(axis.before), iso.figures(axis.after)
        if after.A >= before.A:
            found.append(
                f"{whose}the correction does not improve the stage: what is left is not repeatable"
            )
    return found


def without_corrections(machine: AnyMachine, settings: Any) -> tuple[AnyMachine, Any]:
    """The machine with corrections of nothing."""
    return with_corrections(machine, settings, [Correction() for _ in composite.names(machine)])


def with_corrections(
    machine: AnyMachine, settings: Any, corrections: Sequence[Any]
) -> tuple[AnyMachine, Any]:
    """The machine with a correction of each stage."""
    machine, settings = measuring.ready(machine, settings)
    each = zip(machine.trees(settings), corrections, strict=True)
    return machine, composite.with_trees(machine, settings, [_with(*pair) for pair in each])


def _with(settings: Any, correction: Any) -> Any:
    kind = type(settings.correction)  # that of a stage that turns has other units
    return settings._replace(**{tree.CORRECTION: kind(*correction)})


def _visits(
    machine: AnyMachine, settings: Any, count: int, runs: int, random: np.random.Generator
) -> targets.Visits:
    trees = machine.trees(settings)
    if not isinstance(machine, Composite):
        return targets.along(settings, targets.positions(settings, count, random), runs)
    if machine.has_plane:
        side = max(round(math.sqrt(count)) + 2, 5)
        places = [targets.positions(own, side, random) for own in trees]
        return targets.over(trees, places, max(runs - 2, 1))
    each = [targets.along(own, targets.positions(own, count, random), runs) for own in trees]
    both = np.concatenate([one.target for one in each], axis=1)
    return targets.Visits(each[0].run, each[0].direction, both)


def fit_corrections(
    machine: AnyMachine, settings: Any, readings: Readings, periods: tuple[float, ...] = ()
) -> dict[str, Fit]:
    """The corrections of all stages."""
    trees, names = machine.trees(settings), composite.names(machine)
    plane = isinstance(machine, Composite) and machine.has_plane
    found = {}
    for k, (name, own) in enumerate(zip(names, trees, strict=True)):
        other = 1 - k if plane else -1
        beside = _ends(trees[other]) if plane else (0.0, 1.0)
        data = fitting.data_of(readings, k, _ends(own), other, beside)
        wanted = [*drive_periods(own), *periods]
        fit = fitting.fit(data, wanted, names[other] if plane else "")
        short = readings.direction * (readings.target[:, k] - readings.position[:, k])
        stop = round(float(short.mean()), 9)
        found[name] = fit._replace(correction=fit.correction._replace(stop=stop))
    return found


def _ends(own: Any) -> tuple[float, float]:
    return float(own.travel.low), float(own.travel.high)


def drive_periods(own: Any) -> list[float]:
    """Periods that a drive suggests: a turn of its motor, and of the screw or pulley behind it."""
    if not hasattr(own, "drive"):
        return []
    turn = float(sheets.turn(own))
    return [turn * factor for factor in (1.0, float(getattr(own.drive, "gear", 1.0)), 0.5)]
