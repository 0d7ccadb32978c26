"""The settings of a served machine of one stage: its file's, and the server's."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.columns import Column
from macromicro.control.live.messages import MACRO
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.machines import machine as machines
from macromicro.machines import pace, stage
from macromicro.machines.machine import Machine, as_toml
from macromicro.machines.tree import gains, gains_set, joined
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.schema import config
from macromicro.schema.par import entries
from macromicro.schema.text import printable, read_toml
from macromicro.serve.persist import identity
from macromicro.serve.settings import ServeSettings, kept
from macromicro.serve.stage import guide
from macromicro.serve.stage.programmes import OneStage

_SERVE = "serve"


class _Own(NamedTuple):
    """What a machine's file may say of the server."""

    serve: ServeSettings = ServeSettings()


class StageSettings(NamedTuple):
    """What `serve.settings.LiveSettings` is for the two-stage machine. `tree`: settings of the
    machine `name`; `model`: what it is called."""

    name: str
    model: str
    tree: Any
    live: Live
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    @property
    def machine(self) -> Machine:
        """The machine, under the law of its settings."""
        return machines.under(machines.named(self.name, "machine"), self.tree)

    @property
    def controller(self) -> Any:
        """Gains of its law."""
        return gains(self.tree)

    @property
    def period(self) -> float:
        """Of the live machine, s."""
        return pace.period(self.tree)

    @property
    def law_columns(self) -> tuple[Column, ...]:
        """What its law shows of its memory, of one of another package."""
        machine = self.machine
        return stage.own(machine.kind, machine.law)

    @property
    def speeds(self) -> dict[str, float]:
        """Its fastest moves [m/s, or rad/s], by the stage's name."""
        return {MACRO: self.tree.motion.velocity}

    @property
    def programmes(self) -> OneStage:
        """What clients may run."""
        return OneStage(self.tree)

    def kept_as(self, rig: str) -> str:
        """What the position file calls this machine: with other settings it is another one."""
        return identity(rig, self.name, of_position(self.machine, self.tree))

    def rigs(self, name: str) -> tuple[str, ...]:
        """The rigs that ``--rig`` names."""
        return (name,)

    def place(self, rig: str) -> str:
        """What its position file is called by default."""
        return f"{rig}-{self.name}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        """A file for `--config`: the settings of the machine, its travel as the soft limits are
        now."""
        travel = self.tree.travel._replace(low=limits.whole_low, high=limits.whole_high)
        changed = {gains_set(self.tree): control, "travel": travel}
        return as_toml(self.machine, self.tree._replace(**changed))


_NOT_OF_POSITION = ("law", "controller", "own", "motion", "arrival", "guard")


def of_position(machine: Machine, tree: Any, where: str = "") -> dict[str, Any]:
    """The settings of a stage that its position depends on, each behind `where`: all but those of
    its law, its moves and its guard, of which the place of the stop may depend on one."""
    known = {
        where + e.path: e.value
        for e in entries(tree)
        if e.path.partition(".")[0] not in _NOT_OF_POSITION
    }
    touch = None if machine.touch is None else machine.touch(tree)
    return known if touch is None else known | {f"{where}place": touch.place}


def parted(path: Path) -> tuple[str, dict[str, Any], ServeSettings]:
    """What a machine's file says of the machine, and of the server.

    Raises InputError for what the server's table does not know, and for no TOML.
    """
    file, table = printable(path, 300), read_toml(path, config.WHAT)
    del table[machines.KEY]
    own = {_SERVE: table.pop(_SERVE)} if _SERVE in table else {}
    return file, table, config.overridden(_Own(), own, file).serve if own else ServeSettings()


def load(path: Path, law: str | None = None) -> StageSettings:
    """The settings in a file of a machine of one stage, under its law or another.

    Raises InputError as `machines.machine.load` does, and for a control period that the server is
    too slow for.
    """
    machine = machines.chosen(path)
    file, table, serve = parted(path)
    defaults = machine.settings if law is None else joined(machine.settings, law, "--law")
    tree = config.overridden(defaults, table, file) if table else defaults
    if law is not None:  # the option goes before the file's word
        tree = joined(tree, law, "--law")
    kept(serve, pace.period(tree), file)
    model = f"{machine.name} {printable(Path(path).stem, 60)}".replace(",", " ")
    return StageSettings(machine.name, model, tree, guide.live(machine, tree), serve)
