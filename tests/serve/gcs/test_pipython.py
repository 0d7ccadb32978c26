"""PIPython's own device, unmodified, before real servers."""

from __future__ import annotations

import contextlib
import itertools
import math
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.serve.stage.test_served import PATIENT, example
from tests.systems import posix
from tests.warm import Command

pytest.importorskip("pipython")
from pipython import GCSDevice, GCSError, pitools
from pipython.pidevice.interfaces.pisocket import PISocket

# Its devices close a second time when they are collected.
pytestmark = [
    posix,
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]


@contextlib.contextmanager
def device(folder: Path, text: str) -> Iterator[Any]:
    """PIPython's device of a served machine."""
    (folder / "own.toml").write_text(text + PATIENT, encoding="utf-8")
    command = [sys.executable, "-m", "macromicro", "serve", "--config", "own.toml"]
    command += ["--scpi", "-1", "--web", "-1", "--gcs", "0", "--state", "position.json"]
    with Command(command, stdout=subprocess.PIPE, text=True, cwd=folder) as process:
        try:
            assert process.stdout is not None
            port = ""
            for line in process.stdout:
                found = re.match(r"GCS: 127\.0\.0\.1 port (\d+)", line)
                port = found[1] if found else port
                if line.startswith("Ctrl-C"):
                    break
            with GCSDevice(gateway=PISocket("127.0.0.1", int(port))) as connected:
                yield connected
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(30) == 128 + signal.SIGTERM


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with device(tmp_path_factory.mktemp("screw"), example("screw")) as made:
        yield made


def test_an_axis_references_moves_waits_and_stops(stage: Any) -> None:
    assert "macromicro, axis own" in stage.qIDN() and stage.qCSV() == 2.0
    assert stage.axes == ["1"] and stage.HasMOV() and stage.HasqDRR() and stage.HasStopAll()
    with pytest.raises(GCSError) as refusal:
        stage.MOV(1, 30.0)
    assert refusal.value == 5
    pitools.startup(stage, refmodes="FRF")
    assert stage.qFRF() == {"1": True} and stage.qSVO() == {"1": True}
    low, high = stage.qTMN()["1"], stage.qTMX()["1"]
    assert low < 0.0 and high > 80.0
    stage.MOV("1", 30.0)
    pitools.waitontarget(stage, timeout=60, polldelay=0.02)
    assert stage.qPOS("1")["1"] == pytest.approx(30.0, abs=0.01)
    stage.MVR("1", 5.0)
    pitools.waitontarget(stage, timeout=60, polldelay=0.02)
    assert stage.qPOS()["1"] == pytest.approx(35.0, abs=0.01)
    assert stage.qMOV("1")["1"] == pytest.approx(35.0, abs=1e-3)
    assert not any(stage.IsMoving().values()) and stage.IsControllerReady()
    with pytest.raises(GCSError) as refusal:
        stage.MOV("1", high + 1.0)
    assert refusal.value == 7
    stage.MOV("1", 70.0)
    while not stage.IsMoving()["1"]:
        time.sleep(0.01)
    stage.StopAll(noraise=True)
    pitools.waitontarget(stage, timeout=60)
    assert 34.99 < stage.qPOS()["1"] < 70.0  # a stop may come before a count has gone by
    with pytest.raises(GCSError) as refusal:
        stage.STP()
    assert refusal.value == 10
    assert stage.qERR() == 0
    speed = stage.qVEL()["1"]
    for wrong in (0.0, -1.0, 1.01 * speed):
        with pytest.raises(GCSError) as refusal:
            stage.VEL("1", wrong)
        assert refusal.value == 17
    stage.VEL("1", 0.25 * speed)
    assert stage.qVEL() == {"1": pytest.approx(0.25 * speed)}
    stage.RTR(2)
    stage.MOV("1", 20.0)
    pitools.waitontarget(stage, timeout=60, polldelay=0.02)
    # The reference goes no faster: 2 ms between its values.
    stage.qDRR([1], 1, min(stage.qDRL(1)[1], 1500))
    while stage.bufstate is not True:
        time.sleep(0.01)
    steps = [abs(b - a) / 2e-3 for a, b in itertools.pairwise(stage.bufdata[0])]
    assert max(steps) == pytest.approx(0.25 * speed, rel=0.02)
    stage.VEL("1", speed)


def test_traces_of_the_last_move_are_read(stage: Any) -> None:
    pitools.startup(stage, refmodes="FRF")
    stage.RTR(2)
    before = stage.qPOS()["1"]
    stage.MOV("1", 40.0)
    pitools.waitontarget(stage, timeout=60, polldelay=0.02)
    stage.qPOS()
    count = min(stage.qDRL(1)[1], 300)
    assert count > 50
    header = stage.qDRR([8, 5], 1, count)
    while stage.bufstate is not True:
        time.sleep(0.01)
    place, volts = stage.bufdata
    assert header["SAMPLE_TIME"] == pytest.approx(2e-3) and header["NDATA"] == count
    assert header["NAME0"] == "position [mm]" and header["NAME1"] == "motor [V]"
    assert len(place) == len(volts) == count
    assert place[0] == pytest.approx(before, abs=0.05)
    assert place[-1] > before + 5.0 and max(map(abs, volts)) > 0.1
    assert all(map(math.isfinite, place))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "place", "near"),
    [
        ("", 42.123, 0.01),
        ("piezo-100um", 0.04, 1e-3),
        ("wire-150um", 1.0, 0.02),
        ("disc", 30.0, 0.1),
    ],
)
def test_every_machine_is_a_controller(
    tmp_path: Path, name: str, place: float, near: float
) -> None:
    with device(tmp_path, example(name) if name else "") as stage:
        pitools.startup(stage, refmodes="FRF")
        stage.MOV("1", place)
        pitools.waitontarget(stage, timeout=60, polldelay=0.02)
        assert stage.qPOS("1")["1"] == pytest.approx(place, abs=near)


@pytest.mark.slow
def test_two_axes_are_x_and_y(tmp_path: Path) -> None:
    with device(tmp_path, example("xy-plotter")) as stage:
        pitools.startup(stage, refmodes="FRF")
        assert stage.axes == ["X", "Y"]
        stage.MOV({"X": 20.0, "Y": 30.0})
        pitools.waitontarget(stage, timeout=60, polldelay=0.02)
        stage.MOV("Y", 40.0)
        pitools.waitontarget(stage, timeout=60, polldelay=0.02)
        assert stage.qPOS() == pytest.approx({"X": 20.0, "Y": 40.0}, abs=0.1)
