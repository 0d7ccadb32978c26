"""Commissioning of two axes on one clock: each alone, then both in coordinated moves."""

# The other axis has no effort meanwhile. Each mass includes everything that it carries, so in the
# machine's file neither axis carries the other.

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.calibration.request import CHANNEL
from macromicro.commission import running
from macromicro.commission._verifying import Shifted
from macromicro.commission.calibrating import ReferencedTwin
from macromicro.commission.procedure import Options
from macromicro.commission.running import Calibrate, Commissioned, Place
from macromicro.machines import composite, compositions, on_rig, results, rig, runs
from macromicro.machines.joint import course, planning
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES, DEFAULT
from macromicro.machines.machine import JOINT, KEY
from macromicro.machines.on_rig import Rigs
from macromicro.machines.planning import Schedule
from macromicro.machines.results import JointMove, count_arrived
from macromicro.recording import Recording
from macromicro.schema import config

VERIFY = "verification of both"


class Both(NamedTuple):
    axes: tuple[Commissioned, Commissioned]  # of each
    toml: str  # the machine's file
    settings: Any  # of the machine's file
    plan: Schedule  # the moves that verify it
    recording: Recording
    moves: list[JointMove]  # those that began
    fault: str  # of a guard; "" for none
    calibration: Any = None  # None: it was not calibrated

    @property
    def met(self) -> bool:
        """Whether each axis was verified, and all moves of both arrived."""
        alone = all(one.verified.met for one in self.axes)
        return alone and not self.fault and count_arrived(self.moves) == len(self.plan.legs)


def virtual(path: Path, seed: int, *, calibrate: bool = False) -> tuple[Rigs, tuple[Place, Place]]:
    """The simulated axes of a machine, of which only what a user would know is used."""
    stages = compositions.each(path)
    twin = ReferencedTwin if calibrate else rig.CompiledTwin
    twins = [twin(m.kind, own, seed + k) for k, (_, m, own) in enumerate(stages)]
    names = [f"axis {name} of the machine of {path.name}" for name in AXES]
    return _as_places(Rigs(twins), names, [own for _, _, own in stages], real=False)


def own_places(
    path: Path, name: str, seed: int, *, calibrate: bool = False
) -> tuple[Rigs, tuple[Place, Place]]:
    """Two user's rigs; a machine's file gives pitches, drives and period."""
    machine, settings = compositions.load(path)
    rigs = on_rig.find_rigs(name, machine, settings, seed, "commissioning both axes")
    assert rigs is not None
    if calibrate:
        for one in rigs:
            one.need("--calibrate", CHANNEL)
    names = [f"axis {axis} on {one.name}" for axis, one in zip(AXES, rigs, strict=True)]
    pair, places = _as_places(
        on_rig.open_rigs(rigs, seed), names, machine.trees(settings), real=True
    )
    bounds = [math.inf if one.limits is None else one.limits.motor for one in rigs]
    first, second = (
        place._replace(effort=min(place.effort, most))
        for place, most in zip(places, bounds, strict=True)
    )
    return pair, (first, second)


def _as_places(
    pair: Rigs, names: Sequence[str], trees: Sequence[Any], *, real: bool
) -> tuple[Rigs, tuple[Place, Place]]:
    """Both rigs, each also as a place with the settings that a user would know."""
    first, second = (
        Place(
            name,
            lambda seed, half=half: half,  # type: ignore[misc]
            own.timing.period,
            own.encoder.pitch,
            own.controller.limit,
            real,
        )
        for half, name, own in zip(pair.members, names, trees, strict=True)
    )
    return pair, (first, second)


def commission(
    pair: Rigs,
    places: tuple[Place, Place],
    options: tuple[Options, Options],
    out: Path | None = None,
    *,
    ask: Callable[[str, str], None] = lambda title, intent: None,
    done: Callable[[str], None] = lambda title: None,
    ended: Callable[[], bool] = lambda: False,
    found: Callable[[str, Commissioned], None] = lambda name, one: None,
    calibrate: Calibrate | None = None,
) -> Both:
    """Commission both axes one after the other, verify them together and calibrate them."""
    # Both rigs are entered before anything moves, and left with safe outputs in any case.
    axes = []
    with pair.members[0], pair.members[1]:
        for half in pair.members:
            half.stop()
        for name, place, allowed in zip(AXES, places, options, strict=True):
            one = running.commission(
                place,
                allowed,
                None if out is None else out / name,
                ask=lambda title, intent, name=name: ask(f"{name}, {title}", intent),  # type: ignore[misc]
                done=lambda title, name=name: done(f"{name}, {title}"),  # type: ignore[misc]
                ended=ended,
            )
            found(name, one)
            axes.append(one)
        both = (axes[0], axes[1])
        toml = as_toml(both)
        table = tomllib.loads(toml)
        table.pop(KEY)
        settings = config.overridden(DEFAULT, table, "the identified machine")
        plan = planning.plan(course.usual(settings), settings)
        span = min(settings.x.travel.high, settings.y.travel.high)
        ask(
            VERIFY,
            "Both axes creep to their low ends and move together along a square, a circle "
            f"and a diagonal of up to {1e3 * span:.4g} mm, at up to {settings.path.speed:.3g} "
            "m/s in the plane.",
        )
        with axes[0].work.stand.rig, axes[1].work.stand.rig:
            on = _at_zero(places, both)
            pair.together = True
            try:
                verified = _verify(both, toml, settings, plan, on)
                done(VERIFY)
                if calibrate is not None and verified.met:
                    calibration = calibrate(XY_MACHINE, settings, on)
                    verified = verified._replace(calibration=calibration)
            finally:
                pair.together = False
    return verified


def as_toml(axes: tuple[Commissioned, Commissioned]) -> str:
    lines = [f'{KEY} = "{JOINT}"', "", "[stack]", 'carries = "nothing"  # each mass has it all']
    head: list[str] = []
    for name, one in zip(AXES, axes, strict=True):
        head += [*(["#"] if head else []), f"# Axis {name}."]
        for line in one.toml.splitlines():
            if line.startswith("#"):
                head.append(line)
            elif line.startswith("["):
                lines.append(f"[{name}.{line[1:]}")
            elif not line.startswith(f"{KEY} =") and (line or lines[-1]):
                lines.append(line)
    return "\n".join([*head, "", *lines]) + "\n"


def _at_zero(
    places: tuple[Place, Place], axes: tuple[Commissioned, Commissioned]
) -> tuple[Shifted, ...]:
    """Both axes at their 0."""
    for place, one in zip(places, axes, strict=True):
        place.kind.home(one.work, one.model)
    for one in axes:  # the other's way to its end passed unread
        one.work.stand.rig.wait(one.work.stand.dt)
    return tuple(Shifted(one.work.stand) for one in axes)


def _verify(
    axes: tuple[Commissioned, Commissioned],
    toml: str,
    settings: Any,
    plan: Schedule,
    on: tuple[Shifted, ...],
) -> Both:
    """The coordinated moves."""
    machine = composite.under(XY_MACHINE, settings)
    done = runs.record(machine, settings, plan, on=on, title="verification", warn=False)
    fault = done.outcome.fault
    moves = results.of(XY_MACHINE, done.recording, plan, settings)
    words = "" if fault is None else f"{fault.message} {fault.evidence}"
    return Both(axes, toml, settings, plan, done.recording, moves, words)
