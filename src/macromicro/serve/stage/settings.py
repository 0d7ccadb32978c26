"""Settings of a served single-stage machine."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.columns import Column
from macromicro.control.live.messages import MACRO
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.machines import composite, pace
from macromicro.machines import machine as machines
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.period import law_columns
from macromicro.machines.tree import joined, live_gains, with_live_gains
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.schema import config
from macromicro.schema.par import entries
from macromicro.schema.text import printable
from macromicro.serve.persist import identity
from macromicro.serve.settings import ServeSettings, kept
from macromicro.serve.shared import Telemetry, published
from macromicro.serve.stage import guide
from macromicro.serve.stage._programmes import OneStage

_SERVE = "serve"
EFFORT = "effort", "V"


class _Own(NamedTuple):
    """The server's tables in a machine's file."""

    serve: ServeSettings = ServeSettings()


class StageSettings(NamedTuple):
    """Settings of a served single-stage machine."""

    name: str
    model: str
    tree: Any
    live: Live
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    @property
    def machine(self) -> Machine:
        return machines.under(machines.named(self.name, "machine"), self.tree)

    @property
    def controller(self) -> Any:
        return live_gains(self.tree)

    @property
    def names(self) -> dict[str, str]:
        name = self.name.rpartition(":")[2].lower()  # MODULE:MACHINE of another package
        return {MACRO: "rotary axis" if name == "rotary" else name}

    @property
    def efforts(self) -> dict[str, tuple[str, str]]:
        return {MACRO: EFFORT}

    @property
    def limited(self) -> tuple[str, ...]:
        return ("whole",)

    @property
    def period(self) -> float:
        return pace.period(self.tree)

    @property
    def law_columns(self) -> tuple[Column, ...]:
        return law_columns(composite.stages(self.machine))

    @property
    def telemetry(self) -> Telemetry:
        return published((self.live.place,), ("",), self.law_columns)

    @property
    def axes(self) -> tuple[tuple[str, Live], ...]:
        return ()

    @property
    def trees(self) -> tuple[tuple[str, Any], ...]:
        return (("", self.tree),)

    @property
    def plane(self) -> bool:
        """Whether two stages move in a plane."""
        return False

    @property
    def homing(self) -> tuple[int, ...]:
        """The stages whose position is known by homing, or the first."""
        return (0,)

    @property
    def speeds(self) -> dict[str, float]:
        return {MACRO: self.tree.motion.velocity}

    @property
    def programmes(self) -> OneStage:
        return OneStage(self.tree)

    def kept_as(self, rig: str) -> str:
        return identity(rig, self.name, of_position(self.machine, self.tree))

    def rigs(self, name: str) -> tuple[str, ...]:
        return (name,)

    def place(self, rig: str) -> str:
        return f"{rig}-{self.name}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        """A file for `--config` with the machine's settings and the soft limits in force."""
        travel = self.tree.travel._replace(low=limits.whole_low, high=limits.whole_high)
        tree = with_live_gains(self.tree, control)
        return as_toml(self.machine, tree._replace(travel=travel))


_NOT_OF_POSITION = ("law", "controller", "own", "motion", "arrival", "guard")


def of_position(machine: Machine, tree: Any, where: str = "") -> dict[str, Any]:
    """The settings that the position of a stage depends on."""
    known = {
        where + e.path: e.value
        for e in entries(tree)
        if e.path.partition(".")[0] not in _NOT_OF_POSITION
    }
    touch = None if machine.touch is None else machine.touch(tree)
    return known if touch is None else known | {f"{where}place": touch.place}


def parted(path: Path) -> tuple[str, dict[str, Any], ServeSettings]:
    """Split a machine's file into settings of the machine and of the server."""
    file, table = printable(path, 300), config.table(path)
    del table[machines.KEY]
    own = {_SERVE: table.pop(_SERVE)} if _SERVE in table else {}
    return file, table, config.overridden(_Own(), own, file).serve if own else ServeSettings()


def load(path: Path, law: str | None = None) -> StageSettings:
    """Read the settings of a single-stage machine, for a period that the server can keep."""
    machine = machines.chosen(path)
    file, table, serve = parted(path)
    defaults = machine.settings if law is None else joined(machine.settings, law, "--law")
    tree = config.overridden(defaults, table, file) if table else defaults
    if law is not None:  # the option goes before the file's word
        tree = joined(tree, law, "--law")
    kept(serve, pace.period(tree), file)
    model = f"{machine.name} {printable(Path(path).stem, 60)}".replace(",", " ")
    return StageSettings(machine.name, model, tree, guide.live(machine, tree), serve)
