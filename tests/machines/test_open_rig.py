"""An open rig as a stage: its lines, its enable line and the time that its drive is given."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from macromicro.machines import open_rig
from macromicro.types import SAFE, Sample


class Plain:
    """A rig that names what it is told to, and keeps what it was given."""

    def __init__(self, channels: tuple[str, ...], outputs: tuple[str, ...]) -> None:
        self.channels, self.outputs = channels, outputs
        self.given: list[Any] = []
        self.waits: list[float] = []
        self.clock = SimpleNamespace(now=lambda: 0.0, wait=self.waits.append)

    def read(self) -> Sample:
        return Sample(0.0, 3.0, *[0.0] * 4)

    def write(self, outputs: Any) -> None:
        self.given.append(outputs)


def test_a_rig_without_lines_is_the_plain_stage_and_is_given_plain_outputs() -> None:
    rig = Plain(("encoder",), ("motor",))
    assert open_rig.of(rig) == open_rig.STAGE
    params = open_rig.open_stage(rig, 1e-3)
    assert params.rig is rig
    open_rig.switched_on([params], [open_rig.STAGE], 1.0, 1e-3)
    assert rig.given == [] == rig.waits
    open_rig.STAGE.advance(params, 0.0, 2.0, None, 0, 1e-3)
    assert rig.given == [SAFE._replace(motor=2.0)]


@pytest.mark.parametrize(("rise", "periods"), [(0.0, 1), (0.02, 21), (0.0205, 22)])
def test_a_drive_is_switched_on_and_waited_for(rise: float, periods: int) -> None:
    rig = Plain(("encoder",), ("motor", "enable"))
    kind, params = open_rig.of(rig), open_rig.open_stage(rig, 1e-3)
    assert kind.lines == ("enable",)
    kind.switch(params, 0.0, 0.0)
    open_rig.switched_on([params], [kind], rise, 1e-3)
    assert rig.given == [open_rig.Wired(*SAFE, 1.0)] * periods
    assert rig.waits == [1e-3] * periods
    kind.switch(params, 0.0, 0.0)
    kind.advance(params, 0.0, 1.5, None, 0, 1e-3)
    assert rig.given[-1] == open_rig.Wired(1.5, 0.0, 0.0, 0.0, 0.0)


def test_two_drives_on_one_clock_are_switched_on_at_once() -> None:
    rigs = [Plain(("encoder",), ("motor", "enable")), Plain(("encoder",), ("motor",))]
    kinds, stages = [open_rig.of(r) for r in rigs], [open_rig.open_stage(r, 1e-3) for r in rigs]
    open_rig.switched_on(stages, kinds, 0.02, 1e-3)
    assert rigs[0].given == [open_rig.Wired(*SAFE, 1.0)] * 21
    assert rigs[1].given == [SAFE] * 21  # it has no such line
    assert rigs[0].waits == rigs[1].waits == [1e-3] * 21
