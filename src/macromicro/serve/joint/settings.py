"""The settings of a served machine of two axes: its file's, and the server's."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.columns import Column
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.errors import InputError
from macromicro.machines import pace
from macromicro.machines.joint import machine as joint
from macromicro.machines.joint import runs, two_rigs
from macromicro.machines.joint.machine import Joint
from macromicro.machines.joint.settings import AXES, DEFAULT, of
from macromicro.machines.machine import JOINT
from macromicro.machines.tree import gains, gains_set
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.rig.opening import TWIN
from macromicro.schema.config import overridden
from macromicro.schema.text import printable
from macromicro.serve.joint import control
from macromicro.serve.joint.programmes import TwoAxes
from macromicro.serve.persist import identity
from macromicro.serve.settings import ServeSettings, kept
from macromicro.serve.stage import guide
from macromicro.serve.stage.settings import of_position, parted


class Gains(NamedTuple):
    """Gains of both laws, as clients read and change them."""

    x: Any
    y: Any


class JointSettings(NamedTuple):
    """What `serve.stage.settings.StageSettings` is for one stage. `tree`: settings of the machine;
    `model`: what it is called; `lives`: the live machine's settings of each axis."""

    model: str
    tree: Any
    lives: tuple[Live, Live]
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    @property
    def live(self) -> Live:
        """Those of the first axis."""
        return self.lives[0]

    @property
    def machine(self) -> Joint:
        """The machine, under the laws of its settings."""
        return joint.under(self.tree)

    @property
    def controller(self) -> Gains:
        """Gains of its laws."""
        return Gains(*map(gains, of(self.tree)))

    @property
    def period(self) -> float:
        """Of the live machine, s."""
        return pace.period(self.tree.x)

    @property
    def law_columns(self) -> tuple[Column, ...]:
        """What its laws show of their memory, of those of another package."""
        return control.law_columns(runs.kinds(self.machine), runs.laws(self.machine))

    @property
    def speeds(self) -> dict[str, float]:
        """The fastest moves of each axis [m/s], by its name."""
        return {name: own.motion.velocity for name, own in zip(AXES, of(self.tree), strict=True)}

    @property
    def programmes(self) -> TwoAxes:
        """What clients may run."""
        return TwoAxes(self.tree)

    def kept_as(self, rig: str) -> str:
        """What the position file calls this machine: with other settings it is another one."""
        known: dict[str, Any] = {}
        for name, axis, tree in zip(AXES, self.machine.axes, of(self.tree), strict=True):
            known |= of_position(axis, tree, f"{name}.")
        return identity(rig, JOINT, known)

    def rigs(self, name: str) -> tuple[str, ...]:
        """The rigs that ``--rig`` names, x first. Raises InputError where they are not two."""
        return (name,) if name == TWIN else tuple(two_rigs.named(name))

    def place(self, rig: str) -> str:
        """What its position file is called by default."""
        return f"{rig}-{JOINT}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        """A file for `--config`: the settings of the machine with the gains as they are now."""
        own = zip(AXES, of(self.tree), control, strict=True)
        made = {name: tree._replace(**{gains_set(tree): law}) for name, tree, law in own}
        return joint.as_toml(self.tree._replace(**made))


def load(path: Path, law: str | None = None) -> JointSettings:
    """The settings in a file of a machine of two axes.

    Raises InputError as `joint.machine.load` does, for a law, of which each axis has its own, and
    for a control period that the server is too slow for.
    """
    if law is not None:
        raise InputError("--law", law, joint.LAWS)
    file, table, serve = parted(path)
    tree = overridden(DEFAULT, table, file) if table else DEFAULT
    kept(serve, pace.period(tree.x), file)
    axes = joint.under(tree).axes
    first, second = (guide.live(axis, own) for axis, own in zip(axes, of(tree), strict=True))
    model = f"{JOINT} {printable(Path(path).stem, 60)}".replace(",", " ")
    return JointSettings(model, tree, (first, second), serve)
