"""Settings of a served machine of several stages."""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.columns import Column
from macromicro.control.live.messages import STAGES
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.errors import ProblemError
from macromicro.machines import composite, compositions, on_rig, pace
from macromicro.machines.composite import Composite
from macromicro.machines.machine import KEY, as_toml
from macromicro.machines.period import law_columns
from macromicro.machines.tree import live_gains, with_live_gains
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.rig.opening import TWIN
from macromicro.schema.config import WHAT, overridden
from macromicro.schema.text import printable, read_toml
from macromicro.serve.joint._programmes import SeveralStages
from macromicro.serve.persist import identity
from macromicro.serve.settings import ServeSettings, kept
from macromicro.serve.shared import Telemetry, published
from macromicro.serve.stage import guide
from macromicro.serve.stage.settings import EFFORT, of_position, parted

_LONGEST = 12  # letters of a word of SCPI, whose short form is the first four
# Words of the protocols where the name of a stage may stand.
_TAKEN = (
    *(*STAGES, "whole", "both", "all"),
    *("do", "id", "unit", "replace", "wait"),
    *("absolute", "relative", "number", "outcome", "point", "trust"),
)


class JointSettings(NamedTuple):
    """Settings of a served machine of several stages."""

    model: str
    described: str | dict[str, Any]  # the machine, as its file names or describes it
    whole: Composite  # that machine, whatever laws and lines the settings choose
    tree: Any
    lives: tuple[Live, ...]
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    def __reduce__(self) -> Any:
        """For the loop's process: a tree of stages has a type of its own, made from them."""
        parts = (self.model, self.described, self.tree._asdict(), self.lives, self.serve)
        return _made, parts

    @property
    def stages(self) -> tuple[str, ...]:
        return composite.names(self.whole)

    @property
    def machine(self) -> Composite:
        made: Composite = composite.under(self.whole, self.tree)
        return made

    @property
    def axes(self) -> tuple[tuple[str, Live], ...]:
        return tuple(zip(self.stages, self.lives, strict=True))

    @property
    def trees(self) -> tuple[tuple[str, Any], ...]:
        return tuple(zip(self.stages, self.whole.trees(self.tree), strict=True))

    @property
    def live(self) -> Live:
        return self.lives[0]

    @property
    def controller(self) -> Any:
        """Gains of all laws for clients, by stage."""
        return gains_of(self.stages)(*(live_gains(own) for _, own in self.trees))

    @property
    def names(self) -> dict[str, str]:
        return {name: f"axis {name}" for name in self.stages}

    @property
    def efforts(self) -> dict[str, tuple[str, str]]:
        return dict.fromkeys(self.stages, EFFORT)

    @property
    def limited(self) -> tuple[str, ...]:
        return ("whole",)

    @property
    def period(self) -> float:
        return pace.period(self.whole.trees(self.tree)[0])

    @property
    def law_columns(self) -> tuple[Column, ...]:
        return law_columns(composite.stages(self.machine))

    @property
    def telemetry(self) -> Telemetry:
        places = tuple(live.place for live in self.lives)
        return published(places, self.stages, self.law_columns)

    @property
    def plane(self) -> bool:
        return self.whole.has_plane

    @property
    def homing(self) -> tuple[int, ...]:
        """The stages whose position is known by homing, or the first."""
        each = zip(self.machine.stages, self.trees, strict=True)
        found = (k for k, ((_, one), (_, own)) in enumerate(each) if guide.guide(one, own).touch)
        return tuple(found) or (0,)

    @property
    def speeds(self) -> dict[str, float]:
        return {name: own.motion.velocity for name, own in self.trees}

    @property
    def programmes(self) -> SeveralStages:
        return SeveralStages(self.machine, self.tree)

    def kept_as(self, rig: str) -> str:
        known: dict[str, Any] = {}
        for (_, axis), (name, tree) in zip(self.machine.stages, self.trees, strict=True):
            known |= of_position(axis, tree, f"{name}.")
        return identity(rig, self.whole.name, known)

    def rigs(self, name: str) -> tuple[str, ...]:
        return (name,) if name == TWIN else tuple(on_rig.named(name, self.stages))

    def place(self, rig: str) -> str:
        return f"{rig}-{self.whole.name}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        each = zip(self.trees, control, strict=True)
        made = {name: with_live_gains(tree, law) for (name, tree), law in each}
        return as_toml(self.machine, self.tree._replace(**made))


@cache
def gains_of(stages: tuple[str, ...]) -> Any:
    """A parameter set with the gains of each stage under its name."""
    made: Any = type("Gains", (namedtuple("Gains", stages),), {"__slots__": ()})
    made.__annotations__ = dict.fromkeys(stages, Any)
    return made


def load(path: Path, law: str | None = None) -> JointSettings:
    """Read the settings of a machine of several stages, for a period that the server can keep."""
    described: Any = read_toml(path, WHAT)[KEY]
    whole = _described(described, f"{printable(path, 300)}, {KEY}")
    composite.refuse_law(law, composite.names(whole))
    file, table, serve = parted(path)
    tree = overridden(whole.settings, table, file) if table else whole.settings
    machine = composite.under(whole, tree)
    _served(machine, file)
    trees = machine.trees(tree)
    kept(serve, pace.period(trees[0]), file)
    stages = zip(machine.stages, trees, strict=True)
    lives = tuple(guide.live(axis, own) for (_, axis), own in stages)
    model = f"{machine.name} {printable(Path(path).stem, 60)}".replace(",", " ")
    return JointSettings(model, described, whole, tree, lives, serve)


def _described(described: str | dict[str, Any], where: str) -> Composite:
    whole = compositions.machine(described, where)
    assert isinstance(whole, Composite)
    return whole


def _made(
    model: str,
    described: str | dict[str, Any],
    parts: dict[str, Any],
    lives: tuple[Live, ...],
    serve: ServeSettings,
) -> JointSettings:
    whole = _described(described, KEY)
    tree = whole.settings._replace(**parts)
    return JointSettings(model, described, whole, tree, lives, serve)


def _served(machine: Composite, file: str) -> None:
    """Refuse a machine whose stages clients cannot name, or cannot put in one unit."""
    known = [word[:4] for word in _TAKEN]
    for name in composite.names(machine):
        if name[:4] in known or not name.isalpha() or len(name) > _LONGEST:
            problem = f"clients cannot tell the stage {name} from other words"
            remedy = (
                f"Give it another name of {_LONGEST} letters at most, whose first four are those "
                f"of no other stage and none of {', '.join(_TAKEN)}."
            )
            raise ProblemError(f"{file}, machine", problem, remedy)
        known.append(name[:4])
    if len(set(composite.places(machine))) > 1:
        problem = "some stages turn and others slide, and clients use one unit"
        remedy = "Serve one stage: `macromicro config show --axis NAME` prints its file."
        raise ProblemError(f"{file}, machine", problem, remedy)
