"""Settings of a served machine of two axes."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.columns import Column
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.machines import composite, on_rig, pace
from macromicro.machines.composite import Composite
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES, DEFAULT, of
from macromicro.machines.machine import JOINT, as_toml
from macromicro.machines.period import law_columns
from macromicro.machines.tree import live_gains, with_live_gains
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.rig.opening import TWIN
from macromicro.schema.config import overridden
from macromicro.schema.text import printable
from macromicro.serve.joint._programmes import TwoAxes
from macromicro.serve.persist import identity
from macromicro.serve.settings import ServeSettings, kept
from macromicro.serve.stage import guide
from macromicro.serve.stage.settings import EFFORT, of_position, parted


class Gains(NamedTuple):
    """Gains of both laws for clients."""

    x: Any
    y: Any


class JointSettings(NamedTuple):
    """Settings of a served machine of two axes."""

    model: str
    tree: Any
    lives: tuple[Live, Live]
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    @property
    def live(self) -> Live:
        return self.lives[0]

    @property
    def machine(self) -> Composite:
        made: Composite = composite.under(XY_MACHINE, self.tree)
        return made

    @property
    def controller(self) -> Gains:
        return Gains(*map(live_gains, of(self.tree)))

    @property
    def names(self) -> dict[str, str]:
        return {name: f"axis {name}" for name in AXES}

    @property
    def efforts(self) -> dict[str, tuple[str, str]]:
        return dict.fromkeys(AXES, EFFORT)

    @property
    def limited(self) -> tuple[str, ...]:
        return ("whole",)

    @property
    def period(self) -> float:
        return pace.period(self.tree.x)

    @property
    def law_columns(self) -> tuple[Column, ...]:
        return law_columns(composite.stages(self.machine))

    @property
    def speeds(self) -> dict[str, float]:
        return {name: own.motion.velocity for name, own in zip(AXES, of(self.tree), strict=True)}

    @property
    def programmes(self) -> TwoAxes:
        return TwoAxes(self.tree)

    def kept_as(self, rig: str) -> str:
        known: dict[str, Any] = {}
        for (name, axis), tree in zip(self.machine.stages, of(self.tree), strict=True):
            known |= of_position(axis, tree, f"{name}.")
        return identity(rig, JOINT, known)

    def rigs(self, name: str) -> tuple[str, ...]:
        return (name,) if name == TWIN else tuple(on_rig.named(name))

    def place(self, rig: str) -> str:
        return f"{rig}-{JOINT}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        own = zip(AXES, of(self.tree), control, strict=True)
        made = {name: with_live_gains(tree, law) for name, tree, law in own}
        return as_toml(XY_MACHINE, self.tree._replace(**made))


def load(path: Path, law: str | None = None) -> JointSettings:
    """Read the settings of a two-axis machine, for a period that the server can keep."""
    composite.refuse_law(law, AXES)
    file, table, serve = parted(path)
    tree = overridden(DEFAULT, table, file) if table else DEFAULT
    kept(serve, pace.period(tree.x), file)
    stages = zip(composite.under(XY_MACHINE, tree).stages, of(tree), strict=True)
    first, second = (guide.live(axis, own) for (_, axis), own in stages)
    model = f"{JOINT} {printable(Path(path).stem, 60)}".replace(",", " ")
    return JointSettings(model, tree, (first, second), serve)
