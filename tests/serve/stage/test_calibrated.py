"""A calibrated stage, live: corrected positions, their half width, switched off and on."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Change, Event
from macromicro.machines.signals import Sample
from macromicro.serve import settings
from macromicro.serve.persist import Restored

from .bed import Bed

SCREW = Path(__file__).parents[3] / "examples" / "machines" / "screw.toml"
CORRECTION = """
[correction]
high = "80 mm"
up = ["-10.5 um", "-10.5 um"]
down = ["-8.5 um", "-8.5 um"]
waves = ["3 um", "0 um"]
cold = "19 degC"
hot = "21 degC"
half_width = "1.4 um"

[controller]
rest = "1 um"

[climate]
sensor = 1
rise = "6 K"
time = "2 s"
"""


class Known(Bed):
    """A stage whose place is known from the start, switched on."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self.machine.begin(self.led.read(), Restored(True, 0.0, "known"))
        self.run(2)
        assert self.ask(m.Enable()) == Accepted(0)
        self.run(2)

    @property
    def true(self) -> float:
        kind = self.rig.kinds[0]
        return float(kind.show(self.rig._bench.stages[0], self.rig._states[0]).position)


def test_it_is_truly_where_it_says_until_it_is_switched_off(tmp_path: Path) -> None:
    file = tmp_path / "screw.toml"
    file.write_text(SCREW.read_text(encoding="utf-8") + CORRECTION, encoding="utf-8")
    stage = Known(file)
    assert isinstance(stage.ask(m.MoveTo(0.0412)), Accepted)
    stage.run(800)
    assert stage.true == pytest.approx(0.0412, abs=2.5e-6)
    assert stage.machine.view().position == pytest.approx(0.0412, abs=2e-6)

    # Warmer than the calibration: it says so, once, and its half width grows.
    stage.run(2000)
    told = [n for n in stage.notices if isinstance(n, Event) and n.kind == "temperature"]
    assert len(told) == 1 and 21.0 < told[0].evidence["degC"] < 21.5
    assert stage.machine.view().uncertainty > 1.4e-6 + 1e-6

    off = m.SetGains((("correction.on", 0),))
    assert stage.ask(off) == Accepted(0, (Change("correction.on", 1, 0),))
    stage.run(800)
    assert abs(stage.true - 0.0412) > 5e-6  # what the encoder cannot see is back
    assert stage.machine.view().position == pytest.approx(0.0412, abs=4e-6)
    assert stage.machine.view().uncertainty == pytest.approx(0.5 * stage.pitch)
    assert stage.ask(m.SetGains((("correction.on", 1), ("position", 80.0))))
    stage.run(800)
    assert stage.true == pytest.approx(0.0412, abs=2.5e-6)
    served = settings.load(file)
    assert served is not None
    assert "on = 1" in served.as_toml(served.controller, stage.machine.view().limits)


def test_a_reading_counts_by_the_way_that_led_to_it(tmp_path: Path) -> None:
    file = tmp_path / "screw.toml"
    file.write_text(SCREW.read_text(encoding="utf-8") + CORRECTION, encoding="utf-8")
    stage = Known(file)
    found = []
    for target in (0.02, 0.01):  # upwards, then downwards
        assert isinstance(stage.ask(m.MoveTo(target)), Accepted)
        stage.run(3000)
        seen = Sample(1e3, 0.015)
        found += stage.rig.control.positions((seen,), [20.0])
    assert found[1] - found[0] == pytest.approx(2e-6, abs=5e-8)


def test_a_setting_that_is_not_there_is_refused() -> None:
    stage = Known(SCREW)
    assert not isinstance(stage.ask(m.SetGains((("correction.on", 0),))), Accepted)


@pytest.mark.slow
def test_longer_after_the_start_than_it_was_measured_the_half_width_grows(tmp_path: Path) -> None:
    file = tmp_path / "screw.toml"
    warm = 'warm_up = 1e-3\nwarm_time = "1 s"\nwarm_until = "1 s"\n\n[controller]'
    made = CORRECTION.replace("[controller]", warm, 1).replace("sensor = 1", "sensor = 0")
    file.write_text(SCREW.read_text(encoding="utf-8") + made, encoding="utf-8")
    stage = Known(file)
    assert isinstance(stage.ask(m.MoveTo(0.0412)), Accepted)
    stage.run(800)
    assert stage.machine.view().uncertainty == pytest.approx(1.4e-6)
    stage.run(4000)
    beyond = 1e-3 * 0.0412 * math.exp(-1.0)
    assert 0.9 * beyond < stage.machine.view().uncertainty < 1.4e-6 + beyond
