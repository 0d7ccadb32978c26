"""Commissioning of two axes on one clock: each by itself, then both in coordinated moves.

While one axis is commissioned the other has no effort: it stands, or sinks to its end. What is
found of each has all that it carries in its mass, so the machine's file says that neither carries
the other.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.commission import running
from macromicro.commission.procedure import Options
from macromicro.commission.running import Commissioned, Place
from macromicro.commission.verifying import Shifted
from macromicro.machines import compositions, rig
from macromicro.machines.joint import course, on_rig, planning, results, two_rigs
from macromicro.machines.joint import machine as joint
from macromicro.machines.joint.on_rig import Pair
from macromicro.machines.joint.planning import JointPlan
from macromicro.machines.joint.results import JointMove
from macromicro.machines.joint.settings import AXES, DEFAULT, of
from macromicro.machines.machine import JOINT, KEY
from macromicro.machines.results import arrived
from macromicro.recording import Recording
from macromicro.schema import config

VERIFY = "verification of both"


class Both(NamedTuple):
    """What commissioning two axes found.

    Attributes
    ----------
    axes : tuple[Commissioned, Commissioned]
        Of each.
    toml : str
        The machine's file.
    settings : Any
        What it says, and what follows from it.
    plan : JointPlan
        The moves that verify it.
    recording : Recording
        Of these.
    moves : list[JointMove]
        Those that began.
    fault : str
        What a guard saw meanwhile; "" for nothing.
    """

    axes: tuple[Commissioned, Commissioned]
    toml: str
    settings: Any
    plan: JointPlan
    recording: Recording
    moves: list[JointMove]
    fault: str

    @property
    def met(self) -> bool:
        """Whether each axis was verified, and all moves of both arrived."""
        alone = all(one.verified.met for one in self.axes)
        return alone and not self.fault and arrived(self.moves) == len(self.plan.legs)


def virtual(path: Path, seed: int) -> tuple[Pair, tuple[Place, Place]]:
    """The simulated axes of a machine, of which no more is known than a person would.

    Parameters
    ----------
    path : Path
        Its settings.
    seed : int
        Of the noise of both sensors.

    Returns
    -------
    pair : Pair
        Both rigs.
    places : tuple[Place, Place]
        Each axis, for `running.commission`.

    Raises
    ------
    InputError
        The file is not accepted.
    """
    stages = compositions.each(path)
    twins = [rig.CompiledTwin(m.kind, own, seed + k) for k, (_, m, own) in enumerate(stages)]
    names = [f"axis {name} of the machine of {path.name}" for name in AXES]
    return _placed(Pair(twins), names, [own for _, _, own in stages], real=False)


def own(path: Path, name: str, seed: int) -> tuple[Pair, tuple[Place, Place]]:
    """Two rigs of a user's, of which a machine's file says the pitches, the drives and the period.

    Parameters
    ----------
    path : Path
        Its settings.
    name : str
        Of both rigs, as `two_rigs.found` takes it.
    seed : int
        Given to the factories.

    Returns
    -------
    pair : Pair
        Both rigs.
    places : tuple[Place, Place]
        Each axis, for `running.commission`.

    Raises
    ------
    InputError
        The file, or a rig, is not accepted.
    """
    settings = joint.load(path)[1]
    rigs = two_rigs.found(name, settings, seed, "commissioning both axes")
    assert rigs is not None
    names = [f"axis {axis} on {one.name}" for axis, one in zip(AXES, rigs, strict=True)]
    pair, places = _placed(two_rigs.opened(rigs, seed), names, of(settings), real=True)
    bounds = [math.inf if one.limits is None else one.limits.motor for one in rigs]
    first, second = (
        place._replace(effort=min(place.effort, most))
        for place, most in zip(places, bounds, strict=True)
    )
    return pair, (first, second)


def _placed(
    pair: Pair, names: Sequence[str], trees: Sequence[Any], *, real: bool
) -> tuple[Pair, tuple[Place, Place]]:
    """Both rigs, and each as a place, by as much of its settings as a person would know."""
    first, second = (
        Place(
            name,
            lambda seed, half=half: half,  # type: ignore[misc]
            own.timing.period,
            own.encoder.pitch,
            own.controller.limit,
            real,
        )
        for half, name, own in zip(pair.halves, names, trees, strict=True)
    )
    return pair, (first, second)


def commission(
    pair: Pair,
    places: tuple[Place, Place],
    options: tuple[Options, Options],
    out: Path | None = None,
    *,
    ask: Callable[[str, str], None] = lambda title, intent: None,
    done: Callable[[str], None] = lambda title: None,
    ended: Callable[[], bool] = lambda: False,
    found: Callable[[str, Commissioned], None] = lambda name, one: None,
) -> Both:
    """Commission both axes one after the other, and verify them together.

    Both rigs are entered before anything moves, and left, their outputs safe, however this ends.

    Parameters
    ----------
    pair : Pair
        Both rigs.
    places : tuple[Place, Place]
        Each, whose rig is its half.
    options : tuple[Options, Options]
        What may be done on each.
    out : Path | None, optional
        Folder with one for each axis, in which its steps are kept.
    ask, done, ended : Callable, optional
        As for `running.commission`; titles have the axis in front.
    found : Callable[[str, Commissioned], None], optional
        Called with each axis when it is done.

    Returns
    -------
    Both
        Machine and verification.

    Raises
    ------
    InputError
        An option, or what is kept in `out`, is not accepted.
    CommissionError
        A step cannot do its work; says why.
    KeyboardInterrupt
        Somebody wanted it to end.
    """
    axes = []
    with pair.halves[0], pair.halves[1]:
        for half in pair.halves:
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
        settings = config.overridden(DEFAULT, table, "the machine that was found")
        plan = planning.plan(course.usual(settings), settings)
        span = min(settings.x.travel.high, settings.y.travel.high)
        ask(
            VERIFY,
            "Both axes creep to their low ends, and make a square, a circle and a diagonal of up "
            f"to {1e3 * span:.4g} mm together, at up to {settings.path.speed:.3g} m/s in the "
            "plane.",
        )
        recording, fault = _together(pair, places, both, settings, plan)
    done(VERIFY)
    return Both(both, toml, settings, plan, recording, results.moves(recording, plan, settings),
                fault)  # fmt: skip


def as_toml(axes: tuple[Commissioned, Commissioned]) -> str:
    """The machine's file.

    Parameters
    ----------
    axes : tuple[Commissioned, Commissioned]
        Each with a file of the machine `axis`.

    Returns
    -------
    str
        TOML of the machine of both.
    """
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


def _together(
    pair: Pair,
    places: tuple[Place, Place],
    axes: tuple[Commissioned, Commissioned],
    settings: Any,
    plan: JointPlan,
) -> tuple[Recording, str]:
    """Both axes to their 0, and the moves in step."""
    with axes[0].work.stand.rig, axes[1].work.stand.rig:
        for place, one in zip(places, axes, strict=True):
            place.kind.home(one.work, one.model)
        for one in axes:  # the other's way to its end passed unread
            one.work.stand.rig.wait(one.work.stand.dt)
        on = tuple(Shifted(one.work.stand) for one in axes)
        pair.together = True
        try:
            done = on_rig.record(
                joint.under(settings), settings, plan, (on[0], on[1]), "verification"
            )
        finally:
            pair.together = False
    fault = done.outcome.fault
    return done.recording, "" if fault is None else f"{fault.message} {fault.evidence}"
