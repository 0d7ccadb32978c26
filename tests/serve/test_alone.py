"""Rigs of one stage, served by the loop process: nothing waits for the stage that is not there."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Refused
from macromicro.errors import InputError
from macromicro.serve.settings import LiveSettings
from macromicro.serve.station import Station
from macromicro.serve.web import _reporting

PAGE = (Path(__file__).parents[2] / "docs" / "rigs.md").read_text(encoding="utf-8")
CARRIAGE = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[0]
STAGE = '''

from macromicro.control import calibration


class Stage(Carriage):
    """A micro-stage that follows CTRL, 6 mm for each volt above 1.3 V; a Hall sensor."""

    channels = ("hall",)
    calibration = calibration.default_calibration()

    contraction = 0.0

    def wait(self, dt):
        goal = min(max(self.outputs.ctrl - 1.3, 0.0) * 6e-3, 3.6e-3)
        self.contraction += (goal - self.contraction) * dt / 0.05
        self.ticks += 1

    def read(self):
        low, high, nan = 0.0, 5.0, math.nan
        rising = calibration.position(self.calibration, high) > 1e-3
        for _ in range(40):
            hall = 0.5 * (low + high)
            if (calibration.position(self.calibration, hall) < self.contraction) == rising:
                low = hall
            else:
                high = hall
        return Sample(self.now(), nan, hall + 1e-5 * (self.ticks % 2), nan, nan, nan)


def stage(seed):
    return Stage()


def blind(seed):
    rig = Carriage()
    rig.channels = ("laser",)
    return rig
'''


def patient() -> LiveSettings:
    """A loaded test computer misses periods: that is not what is looked at here."""
    plain = LiveSettings()
    sequence = plain.controller.sequence._replace(wait=0.1)
    return plain._replace(
        controller=plain.controller._replace(sequence=sequence),
        serve=plain.serve._replace(miss_share=1.0, loop_timeout=5.0, parent_timeout=5.0),
    )


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module of rigs in the working directory; its name."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    name = f"lab{os.getpid()}_{abs(hash(str(tmp_path)))}"
    (tmp_path / f"{name}.py").write_text(CARRIAGE + STAGE, encoding="utf-8")
    return name


def done(station: Station, request: m.Request) -> m.Finished:
    reply = station.request("a test", request)
    assert isinstance(reply, Accepted), reply
    end = station.finished(reply.id, 60.0)
    assert end is not None
    return end


def test_a_carriage_alone(lab: str, tmp_path: Path) -> None:
    with Station(f"{lab}:bench", settings=patient(), state=tmp_path / "p.json") as station:
        assert station.stages == (m.MACRO,)
        station.acquire("a test")
        assert isinstance(station.request("a test", m.Enable()), Accepted)
        assert done(station, m.Home()).outcome == "done"
        assert done(station, m.MoveMacro(200)).outcome == "done"
        end = done(station, m.MoveTo(0.01))
        assert end.outcome == "done" and end.position == pytest.approx(0.01, abs=4e-5)
        for request in (m.MoveMicro(1e-3), m.SetGains((("pi.kp", 1.0),))):
            reply = station.request("a test", request)
            assert isinstance(reply, Refused) and "no micro-stage" in reply.reason
        now = station.snapshot()
        assert now.trusted and now.ctrl_v == 0.0
        offered = _reporting.sensible_orders(now, False, station.stages)
        assert "move macro" in offered and "move micro" not in offered


@pytest.mark.slow
def test_a_micro_stage_alone(lab: str, tmp_path: Path) -> None:
    for _ in range(2):  # its place needs no file
        with Station(f"{lab}:stage", settings=patient(), state=tmp_path / "p.json") as station:
            assert station.stages == (m.MICRO,)
            station.acquire("a test")
            assert isinstance(station.request("a test", m.Enable()), Accepted)
            end = done(station, m.MoveTo(1.2e-3))
            assert end.outcome == "done" and end.position == pytest.approx(1.2e-3, abs=2e-5)
            reply = station.request("a test", m.Home())
            assert isinstance(reply, Refused) and "no macro-stage" in reply.reason
            now = station.snapshot()
            assert now.trusted and now.motor_v == 0.0


def test_a_rig_of_neither_is_refused(lab: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"channels.*laser.*encoder \(macro-stage\)"):
        Station(f"{lab}:blind", settings=patient(), state=tmp_path / "p.json").start()
