"""Virtual stages that are commissioned in tests, with a reading that may be turned round."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from macromicro.commission import kinds
from macromicro.commission.procedure import Options
from macromicro.commission.running import Place
from macromicro.machines import machine, rig
from macromicro.types import Sample

MACHINES = Path(__file__).parents[2] / "examples" / "machines"


class Turned(rig.CompiledTwin):
    """A twin whose reading falls as it moves, and begins anywhere."""

    def read(self) -> Sample:
        sample = super().read()
        return sample._replace(encoder=777.0 - sample.encoder)


def stage(name: str, *, turned: bool = False) -> tuple[Place, Options, Any]:
    """What is commissioned, how, and its settings for the comparison."""
    chosen, tree = machine.load(MACHINES / name)
    kind = kinds.by_name(chosen.name)
    assert kind is not None
    made = Turned if turned else rig.CompiledTwin
    gains = tree.controller
    place = Place(
        name, lambda seed: made(chosen.kind, tree, seed), tree.timing.period, tree.encoder.pitch,
        gains.high, False, kind, gains.low,
    )  # fmt: skip
    return place, Options(gains.high, 0.5, 0.02, 0.5, lowest=gains.low), tree
