"""Opens a machine of one or several stages for the loop process and warms it up."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from macromicro.control.live import messages as m
from macromicro.errors import ProblemError
from macromicro.machines import guarding, lines, on_rig
from macromicro.machines import rig as machine_rig
from macromicro.machines.composite import IN_TURN, Composite
from macromicro.machines.machine import Machine
from macromicro.machines.stage_trees import all_of
from macromicro.rig.session import Fixture, Session
from macromicro.rig.twin import VirtualClock
from macromicro.serve._launching import Spec
from macromicro.serve._machine import Opened
from macromicro.serve._programmes import USUAL
from macromicro.serve.settings import AnySettings, StageSettings
from macromicro.serve.stage import guide
from macromicro.serve.stage._group import StageGroup
from macromicro.serve.stage._machine import Led
from macromicro.serve.stage._playing import Together
from macromicro.serve.stage.rig import Guarded, Real, Simulated
from macromicro.serve.warming import rehearse
from macromicro.types import ENABLE, QUIET

REST = 100  # periods within which a set point is braked and the stage stands


def _requests(settings: StageSettings) -> Iterator[tuple[Any, int]]:
    """What is rehearsed, each request with the periods after it."""
    ends = {name: own.limits for name, own in settings.axes or (("macro", settings.live),)}
    middle = {name: 0.5 * (end.whole_low + end.whole_high) for name, end in ends.items()}
    first = next(iter(middle))
    yield m.Stop(), 2  # nothing is enabled before the first sample, which is seen behind it
    yield m.Enable(), 10
    # First: homing takes the trust, and then moves are refused.
    yield m.MovePoint(middle) if settings.axes else m.MoveTo(middle[first]), 40
    yield m.Stop(), REST
    if settings.axes:
        yield m.Programme(settings.programmes.named(USUAL, settings.live.limits).plan), 40
        yield m.Stop(), REST
    yield m.Jog(first, settings.live.jogging.slow), 40
    yield m.Jog(first, 0.0), REST
    yield m.Home(), 40
    yield m.EmergencyStop(), 10
    yield m.ClearFault(), 10
    yield m.Disable(), 10


class Like(machine_rig.Twin):
    """A twin with the channels and outputs of another rig; missing lines stay quiet."""

    def __init__(self, machine: Machine, tree: Any, other: Any) -> None:
        super().__init__(machine.kind, tree)
        self.channels, self.outputs = tuple(other.channels), tuple(other.outputs)

    def read(self) -> Any:
        shown = super().read()
        if isinstance(shown, machine_rig.Seen) or not lines.of(self.channels):
            return shown
        return machine_rig.Seen(*shown, *QUIET)


def open_machine(spec: Spec) -> Opened:
    """The machine of `spec`; nothing is switched on."""
    settings: AnySettings = spec.settings
    assert isinstance(settings, StageSettings)
    machine, tree = settings.machine, settings.tree
    what = f"serving {all_of(len(settings.axes))}" if settings.axes else "serving"
    found = on_rig.find_rigs(spec.rig, machine, tree, spec.seed, what)
    if found is None:
        return _on(settings, simulate(settings, spec.seed))
    for (name, stage), own, fixture in zip(machine.stages, machine.trees(tree), found, strict=True):
        require_lines(stage, own, fixture, f"{name}." if name else "")
    made = [fixture.make(spec.seed + k) for k, fixture in enumerate(found)]
    paced = any(not isinstance(each.clock, VirtualClock) for each in made)
    counted = all(fixture.counted for fixture in found)
    return _on(settings, Real(machine, tree, made))._replace(paced=paced, counted=counted)


def _on(settings: StageSettings, rig: Simulated | Real) -> Opened:
    def guarded(session: Session, rig: Simulated | Real = rig) -> Guarded:
        return Guarded(session, rig, settings.axes)

    def warm() -> None:
        like = _like(settings, rig) if isinstance(rig, Real) else simulate(settings, 0)
        inside = guarded(Session(like, settings.period), like)
        rehearse(inside, live(settings, like), settings, tuple(_requests(settings)))

    return Opened(rig, live(settings, rig), guarded, warm)


def require_lines(machine: Machine, tree: Any, fixture: Fixture, where: str = "") -> None:
    """Refuse a rig without a line that homing needs."""
    touch = guide.guide(machine, tree).touch
    seek = None if touch is None else touch.seek
    if seek is None:
        return
    needs = (seek.line, "index_count" if seek.pulse else "")
    missing = [name for name in needs if name and not fixture.has(name)]
    if missing:
        problem = f'{where}homing.on = "{tree.homing.on}" needs {" and ".join(missing)}'
        remedy = f"The rig has {', '.join(fixture.channels)}."
        raise ProblemError(f"--rig {fixture.name}, channels", problem, remedy)


def _like(settings: StageSettings, rig: Real) -> Real:
    machine, trees = settings.machine, settings.machine.trees(settings.tree)
    each = zip(machine.stages, trees, rig.rigs, strict=True)
    likes = [Like(stage, own, other) for (_, stage), own, other in each]
    return Real(machine, settings.tree, likes)


def simulate(settings: StageSettings, seed: int) -> Simulated:
    pitches = [own.pitch for _, own in settings.axes] or [settings.live.pitch]
    return Simulated(settings.machine, settings.tree, pitches, seed)


def live(settings: StageSettings, rig: Simulated | Real) -> Led | StageGroup:
    """The live machine on such a rig."""
    machine, tree = settings.machine, settings.tree
    trees, leds = machine.trees(tree), {}
    for k, ((name, stage), own) in enumerate(zip(machine.stages, trees, strict=True)):
        lead = guide.guide(stage, own, switched=ENABLE in rig.kinds[k].lines)

        def take(tree: object, k: int = k) -> None:
            rig.control.take(tree, k)

        led = Led(guide.parameters(stage, own), lead, settings.period, own, take)
        led.lines = lambda k=k: rig.lines[k]  # type: ignore[misc]
        led.degrees = lambda k=k: rig.lines[k].temperature  # type: ignore[misc]
        led.leaning = lambda k=k: guarding.leaning(rig.control.watches[k])  # type: ignore[misc]
        leds[name] = led
    if not isinstance(machine, Composite):
        return leds[""]
    path = (tree.path.speed, tree.path.acceleration) if machine.has_plane else ()
    return StageGroup(
        leds,
        Together(trees, *path),
        lambda: rig.shown,
        lambda: rig.control.efforts,
        in_turn=machine.order == IN_TURN,
    )
