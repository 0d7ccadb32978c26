"""Both axes on two rigs of a user's, served in step under the laws and guards of a file."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.serve.stage.test_served import PATIENT, served
from tests.systems import posix
from tests.waiting import until

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.errors import InputError
from macromicro.serve import settings
from macromicro.serve._launching import LIVE, Spec
from macromicro.serve.stage import opening
from macromicro.serve.station import Station

TEXT = """machine = "xy"
[x.load]
stop_high = "90 mm"
[y.load]
stop_high = "70 mm"
"""
VOLTS, STOPS, LEFT, PID = range(4)  # of what a rig notes
RIGS = """
import os
import time
from pathlib import Path

import numpy as np

from macromicro.machines import compositions, rig

HERE = Path(__file__).parent


class Noted(rig.CompiledTwin):
    "It notes what it is given, for whoever is in another process; `bad`: what it gets wrong."

    def __init__(self, name, seed, bad=""):
        k = ("x", "y").index(name)
        _, machine, own = compositions.each(HERE / "axes.toml")[k]
        super().__init__(machine.kind, own, seed)
        self._note = np.memmap(HERE / name, float, "r+", shape=4)
        self._bad = bad

    def read(self):
        shown = super().read()
        broken = (HERE / "break").exists()
        if broken and self._bad == "raises":
            raise OSError("the cable is off")
        if broken and self._bad == "blind":
            return shown._replace(encoder=float("nan"))
        if broken and self._bad == "hangs":
            time.sleep(60.0)
        return shown

    def write(self, outputs):
        super().write(outputs)
        self._note[0], self._note[3] = outputs.motor, os.getpid()

    def stop(self):
        if self._bad == "stop":
            raise OSError("it cannot be stopped")
        super().stop()
        self._note[:2] = 0.0, self._note[1] + 1.0

    def __exit__(self, *error):
        self._note[2] += 1.0


def x(seed):
    return Noted("x", seed)

def y(seed):
    return Noted("y", seed)

def x_raises(seed):
    return Noted("x", seed, "raises")

def y_blind(seed):
    return Noted("y", seed, "blind")

def y_hangs(seed):
    return Noted("y", seed, "hangs")

def y_counted(seed):
    made = y(seed)
    made.counted = True
    return made

def x_counted(seed):
    made = x(seed)
    made.counted = True
    return made

def x_stuck(seed):
    return Noted("x", seed, "stop")

def y_stuck(seed):
    return Noted("y", seed, "stop")

def deaf(seed):
    made = y(seed)
    made.channels = ("laser",)
    return made
"""


class Lab:
    """A folder with a machine's file, a module of rigs, and what they have noted."""

    def __init__(self, folder: Path, text: str = TEXT) -> None:
        self.folder, self.module = folder, f"two{os.getpid()}"
        (folder / "axes.toml").write_text(text)
        (folder / "own.toml").write_text(text + PATIENT)
        (folder / f"{self.module}.py").write_text(RIGS)
        for name in ("x", "y"):
            np.zeros(4).tofile(folder / name)

    def rigs(self, x: str = "x", y: str = "y") -> str:
        return f"{self.module}:{x}+{self.module}:{y}"

    def noted(self, what: int) -> tuple[float, float]:
        x, y = (float(np.fromfile(self.folder / name)[what]) for name in ("x", "y"))
        return x, y

    def breaks(self) -> None:
        (self.folder / "break").touch()


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Lab:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    return Lab(tmp_path)


@pytest.fixture
def station(lab: Lab) -> Iterator[Callable[..., Station]]:
    made: list[Station] = []

    def start(rigs: str) -> Station:
        there = Station(rigs, settings=settings.load(Path("own.toml")), state=lab.folder / "p.json")
        made.append(there)
        there.start()
        there.acquire("a test")
        assert there.request("a test", m.Enable()) == Accepted(0)
        return there

    yield start
    for there in made:
        there.stop()


def done(station: Station, request: Any) -> Any:
    reply = station.request("a test", request)
    assert isinstance(reply, Accepted), reply
    return station.finished(reply.id, 60.0)


@pytest.mark.slow
def test_they_are_served_like_the_simulated_pair(lab: Lab) -> None:
    with served(lab.folder, TEXT, "--rig", lab.rigs()) as client:
        assert "loop: 1000 Hz" in client.said
        assert client.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
        assert client.ask("POS:TRUS?") == '1,"homed"'
        assert client.ask("MOVE:POIN 40 MM,20 MM;*OPC?") == "1"
        x, y, trusted = client.ask("POS:POIN?").split(",")
        assert (float(x), float(y)) == pytest.approx((40.0, 20.0), abs=0.05) and trusted == "1"
        client.send("MOVE:POIN 10 MM,50 MM")
        while float(client.ask("POS:POIN?").split(",")[0]) > 32.0:
            assert all(volts != 0.0 for volts in lab.noted(VOLTS))
        client.send("STOP")
        assert client.ask("*OPC?") == "1" and client.ask("MODE?") == '"stopped"'
        x, y = (float(each) for each in client.ask("POS:POIN?").split(",")[:2])
        assert 10.0 < x < 32.0 and y - 20.0 == pytest.approx(40.0 - x, abs=0.2)  # on the line
        assert "ended as stopped" in client.ask("SYST:ERR:ALL?")
        client.send("ABOR")
        assert client.ask("ENAB?") == "0"
        assert lab.noted(VOLTS) == (0.0, 0.0)
        x, y, _ = client.ask("POS:POIN?").split(",")
    assert lab.noted(LEFT) == (1.0, 1.0) and min(lab.noted(STOPS)) > 0.0


@pytest.mark.slow
def test_a_fault_of_one_takes_the_effort_off_both(
    lab: Lab, station: Callable[..., Station]
) -> None:
    there = station(lab.rigs(y="y_blind"))
    assert done(there, m.Home()).outcome == m.DONE
    reply = there.request("a test", m.MovePoint({"x": 0.06, "y": 0.04}))
    assert isinstance(reply, Accepted)
    until(lambda: all(lab.noted(VOLTS)))
    lab.breaks()
    end = there.finished(reply.id, 20.0)
    assert end is not None and end.outcome == m.FAULTED
    fault = there.snapshot().fault
    assert fault is not None and fault.name.startswith("y: ") and "both axes" in fault.evidence
    until(lambda: lab.noted(VOLTS) == (0.0, 0.0))
    (lab.folder / "break").unlink()
    for request in (m.ClearFault(), m.Enable()):
        assert there.request("a test", request) == Accepted(0)
    assert done(there, m.Home()).outcome == m.DONE  # the place of both was lost


@pytest.mark.parametrize(
    ("x", "y", "free"),
    [("x_raises", "y_stuck", 0), pytest.param("x_stuck", "y", 1, marks=pytest.mark.slow)],
)
def test_one_that_cannot_be_stopped_leaves_the_other_stopped(
    lab: Lab, station: Callable[..., Station], x: str, y: str, free: int
) -> None:
    there = station(lab.rigs(x, y))
    reply = there.request("a test", m.Home())
    assert isinstance(reply, Accepted)
    until(lambda: all(lab.noted(VOLTS)))
    if x == "x_raises":
        lab.breaks()
    else:
        there.emergency("a test")
    until(lambda: lab.noted(LEFT)[0] >= 2.0)  # the last time by a process of its own
    assert lab.noted(VOLTS)[free] == 0.0 and lab.noted(STOPS)[free] > 0.0
    assert lab.noted(VOLTS)[1 - free] != 0.0 and lab.noted(LEFT)[1 - free] > 0.0
    fault = there.snapshot().fault
    until(lambda: "may still be as last written" in there.snapshot().fault.evidence)  # type: ignore[union-attr]
    fault = there.snapshot().fault
    assert fault is not None and f"{lab.module}:{(x, y)[1 - free]}: a fresh" in fault.evidence


@pytest.mark.slow
def test_one_that_hangs_stops_both(lab: Lab, station: Callable[..., Station]) -> None:
    """The loop's process is ended, and leaves both on its way."""
    there = station(lab.rigs(y="y_hangs"))
    reply = there.request("a test", m.Home())
    assert isinstance(reply, Accepted)
    until(lambda: all(lab.noted(VOLTS)))
    lab.breaks()
    end = there.finished(reply.id, 30.0)
    assert end is not None and end.outcome == m.FAULTED
    until(lambda: lab.noted(LEFT) == (1.0, 1.0))
    assert lab.noted(VOLTS) == (0.0, 0.0)
    until(lambda: "SIGTERM; the rig's stop returned" in there.snapshot().fault.evidence)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("x", "y", "known"), [("x_counted", "y_counted", 1), ("x", "y_counted", 0)]
)
def test_both_counters_confirm_the_place(lab: Lab, x: str, y: str, known: int) -> None:
    found = settings.load(Path("own.toml"))
    made = opening.open_machine(Spec(lab.rigs(x, y), 0, found, "", LIVE, os.getpid()))
    assert made.witness(made.rig.read()).counted == bool(known)
    assert not made.paced  # both rigs' time is computed: somebody else has to wait


@posix
def test_a_killed_loop_leaves_two_rigs_that_other_processes_stop(
    lab: Lab, station: Callable[..., Station]
) -> None:
    there = station(lab.rigs())
    reply = there.request("a test", m.Home())
    assert isinstance(reply, Accepted)
    until(lambda: all(lab.noted(VOLTS)))
    os.kill(int(lab.noted(PID)[0]), signal.SIGKILL)
    end = there.finished(reply.id, 20.0)
    assert end is not None and end.outcome == m.LOST
    until(lambda: lab.noted(LEFT) == (1.0, 1.0))
    assert lab.noted(VOLTS) == (0.0, 0.0)
    until(lambda: there.snapshot().fault.evidence.count("a fresh process opened the rig") == 2)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("changes", "rigs", "where", "accepted"),
    [
        ({}, ("x", ""), "--rig", "x first"),
        ({}, ("x", "deaf"), "serving both axes needs encoder", "`channels`"),
        ({"x.timing.period": "0.5 ms", "y.timing.period": "0.5 ms"}, ("x", "y"), "", "0.001 s"),
        (
            {"y.homing.on": "home", "y.switches.home": "below"},
            ("x", "y"),
            "channels",
            "y.homing.on",
        ),
    ],
)
def test_what_two_rigs_cannot_do_is_said(
    lab: Lab, changes: dict[str, str], rigs: tuple[str, str], where: str, accepted: str
) -> None:
    found = settings.load(Path("own.toml"))
    name = lab.rigs(*rigs) if rigs[1] else f"{lab.module}:x"
    spec = Spec(name, 0, found._replace(tree=found.tree.with_(changes)), "", LIVE, os.getpid())
    with pytest.raises(InputError) as error:
        opening.open_machine(spec)
    said = str(error.value)
    assert where in said and accepted in said
