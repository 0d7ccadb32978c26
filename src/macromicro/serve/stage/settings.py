"""Settings of a served machine of one or several stages, each under a law of its own."""

from __future__ import annotations

from collections import namedtuple
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from macromicro.columns import Column
from macromicro.control.live.messages import MACRO, STAGES
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.errors import ProblemError
from macromicro.machines import composite, compositions, on_rig, pace
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.machine import KEY, Machine, as_toml
from macromicro.machines.period import law_columns
from macromicro.machines.tree import joined, live_gains, with_live_gains
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.rig.opening import TWIN
from macromicro.schema import config
from macromicro.schema.par import entries
from macromicro.schema.text import printable, read_toml
from macromicro.serve._programmes import OneStage, Programmes, SeveralStages
from macromicro.serve.persist import identity
from macromicro.serve.settings import ServeSettings, kept
from macromicro.serve.shared import Telemetry, published
from macromicro.serve.stage import guide

EFFORT = "effort", "V"
_SERVE = "serve"
_LONGEST = 12  # letters of a word of SCPI, whose short form is the first four
# Words of the protocols where the name of a stage may stand.
_TAKEN = (
    *(*STAGES, "whole", "both", "all"),
    *("do", "id", "unit", "replace", "wait"),
    *("absolute", "relative", "number", "outcome", "point", "trust"),
)
_NOT_OF_POSITION = ("law", "controller", "own", "motion", "arrival", "guard")


class _Own(NamedTuple):
    """The server's tables in a machine's file."""

    serve: ServeSettings = ServeSettings()


class StageSettings(NamedTuple):
    """Settings of a served machine of one stage, or of several that have names."""

    model: str
    described: str | dict[str, Any]  # the machine, as its file names or describes it
    whole: AnyMachine  # that machine, whatever laws and lines the settings choose
    tree: Any
    lives: tuple[Live, ...]
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    def __reduce__(self) -> Any:
        """For the loop's process: a tree of stages has a type of its own, made from them."""
        parts = (self.model, self.described, self.tree._asdict(), self.lives, self.serve)
        return _made, parts

    @property
    def several(self) -> bool:
        return isinstance(self.whole, Composite)

    @property
    def stages(self) -> tuple[str, ...]:
        """Their names; "" of an only one."""
        return composite.names(self.whole)

    @property
    def machine(self) -> Any:
        return composite.under(self.whole, self.tree)

    @property
    def axes(self) -> tuple[tuple[str, Live], ...]:
        """The named stages."""
        return tuple(zip(self.stages, self.lives, strict=True)) if self.several else ()

    @property
    def trees(self) -> tuple[tuple[str, Any], ...]:
        """The settings of each stage, under its name."""
        return tuple(zip(self.stages, self.whole.trees(self.tree), strict=True))

    @property
    def live(self) -> Live:
        return self.lives[0]

    @property
    def controller(self) -> Any:
        """Gains of the law for clients; of several laws by stage."""
        each = [live_gains(own) for _, own in self.trees]
        return _gains_of(self.stages)(*each) if self.several else each[0]

    @property
    def names(self) -> dict[str, str]:
        if self.several:
            return {name: f"axis {name}" for name in self.stages}
        name = self.whole.name.rpartition(":")[2].lower()  # MODULE:MACHINE of another package
        return {MACRO: "rotary axis" if name == "rotary" else name}

    @property
    def efforts(self) -> dict[str, tuple[str, str]]:
        return dict.fromkeys(self.names, EFFORT)

    @property
    def limited(self) -> tuple[str, ...]:
        return ("whole",)

    @property
    def period(self) -> float:
        return pace.period(self.trees[0][1])

    @property
    def law_columns(self) -> tuple[Column, ...]:
        return law_columns(composite.stages(self.machine))

    @property
    def telemetry(self) -> Telemetry:
        places = tuple(live.place for live in self.lives)
        return published(places, self.stages, self.law_columns)

    @property
    def plane(self) -> bool:
        """Whether two stages move in a plane."""
        return isinstance(self.whole, Composite) and self.whole.has_plane

    @property
    def homing(self) -> tuple[int, ...]:
        """The stages whose position is known by homing, or the first."""
        each = zip(self.machine.stages, self.trees, strict=True)
        found = (k for k, ((_, one), (_, own)) in enumerate(each) if guide.guide(one, own).touch)
        return tuple(found) or (0,)

    @property
    def speeds(self) -> dict[str, float]:
        """Maximum speeds of moves."""
        return {name or MACRO: own.motion.velocity for name, own in self.trees}

    @property
    def programmes(self) -> Programmes:
        if self.several:
            return SeveralStages(self.machine, self.tree)
        return OneStage(self.tree)

    def tables(self, key: str) -> str:
        """Its table [serve] as TOML, or one parameter."""
        return config.as_toml(_Own(self.serve), key)

    def kept_as(self, rig: str) -> str:
        """The machine's identity in the position file."""
        known: dict[str, Any] = {}
        for (_, one), (name, tree) in zip(self.machine.stages, self.trees, strict=True):
            known |= _of_position(one, tree, f"{name}." if name else "")
        return identity(rig, self.whole.name, known)

    def rigs(self, name: str) -> tuple[str, ...]:
        if self.several and name != TWIN:
            return tuple(on_rig.named(name, self.stages))
        return (name,)

    def place(self, rig: str) -> str:
        """Default name of its position file."""
        return f"{rig}-{self.whole.name}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        """A file for `--config` with the gains in force, and the soft limits of an only stage."""
        if not self.several:
            travel = self.tree.travel._replace(low=limits.whole_low, high=limits.whole_high)
            tree = with_live_gains(self.tree, control)
            return as_toml(self.machine, tree._replace(travel=travel))
        each = zip(self.trees, control, strict=True)
        made = {name: with_live_gains(tree, law) for (name, tree), law in each}
        return as_toml(self.machine, self.tree._replace(**made))


@cache
def _gains_of(stages: tuple[str, ...]) -> Any:
    """A parameter set with the gains of each stage under its name."""
    made: Any = type("Gains", (namedtuple("Gains", stages),), {"__slots__": ()})
    made.__annotations__ = dict.fromkeys(stages, Any)
    return made


def _of_position(machine: Machine, tree: Any, where: str) -> dict[str, Any]:
    """The settings that the position of a stage depends on."""
    known = {
        where + e.path: e.value
        for e in entries(tree)
        if e.path.partition(".")[0] not in _NOT_OF_POSITION
    }
    touch = None if machine.touch is None else machine.touch(tree)
    return known if touch is None else known | {f"{where}place": touch.place}


def load(path: Path, law: str | None = None) -> StageSettings:
    """Read the settings of a machine, for a period that the server can keep."""
    file, table = printable(path, 300), config.table(path)
    described: Any = read_toml(path, config.WHAT)[KEY]
    whole = compositions.machine(described, f"{file}, {KEY}")
    if isinstance(whole, Composite):
        composite.refuse_law(law, composite.names(whole))
    del table[KEY]
    own = {_SERVE: table.pop(_SERVE)} if _SERVE in table else {}
    serve = config.overridden(_Own(), own, file).serve if own else ServeSettings()
    tree = whole.settings if law is None else joined(whole.settings, law, "--law")
    tree = config.overridden(tree, table, file) if table else tree
    if law is not None:  # the option goes before the file's word
        tree = joined(tree, law, "--law")
    machine = composite.under(whole, tree)
    if isinstance(whole, Composite):
        _served(machine, file)
    trees = whole.trees(tree)
    kept(serve, pace.period(trees[0]), file)
    stages = zip(machine.stages, trees, strict=True)
    lives = tuple(guide.live(one, own) for (_, one), own in stages)
    model = f"{machine.name} {printable(Path(path).stem, 60)}".replace(",", " ")
    return StageSettings(model, described, whole, tree, lives, serve)


def _made(
    model: str,
    described: str | dict[str, Any],
    parts: dict[str, Any],
    lives: tuple[Live, ...],
    serve: ServeSettings,
) -> StageSettings:
    whole = compositions.machine(described, KEY)
    tree = whole.settings._replace(**parts)
    return StageSettings(model, described, whole, tree, lives, serve)


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
