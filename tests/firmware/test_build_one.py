"""docs/board.md on the simulated board: every command that the page has, in its order.

The programmer is a stand-in that keeps the file, and the simulated board runs that very file. All
commands share one board; `--yes` answers what a person would be asked.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from macromicro.machines import machine
from macromicro.serve.health import FAIL
from tests.firmware.built import ROOT, needs_avr
from tests.firmware.test_process import DEADLINE, simulated
from tests.serve.scpi.client import Client
from tests.systems import posix

pytestmark = [posix, needs_avr, pytest.mark.timeout(1800)]
PAGE = (ROOT / "docs" / "board.md").read_text("utf-8")
COMMANDS = re.findall(r"^ {4}((?:macromicro|sha256sum|avrdude) .*)$", PAGE, re.MULTILINE)
EXPORT, CHECK, FLASH, OPEN, WALK, MOVE, COMMISSION, RUN, SERVE = COMMANDS  # all, in this order
DEVICE = "/dev/ttyUSB0"
AVRDUDE = """#!/bin/sh
for last; do :; done
file=${last#flash:w:}
cp "${file%:i}" flashed.hex && echo verified
"""
PATIENT = """
[serve]
miss_share = 1.0
loop_timeout = "10 s"
parent_timeout = "10 s"
client_timeout = "60 s"
"""


class Maker(NamedTuple):
    """Where the page is followed, and the board's port there."""

    folder: Path
    port: Path

    def words(self, command: str) -> list[str]:
        """A command of the page for this board."""
        name, *rest = shlex.split(command.replace(DEVICE, str(self.port)))
        assert name == "macromicro" and str(self.port) in command.replace(DEVICE, str(self.port))
        return [sys.executable, "-m", "macromicro", *rest]

    def run(self, command: str, *more: str) -> subprocess.CompletedProcess[str]:
        """What became of it."""
        words = [*self.words(command), *more]
        return subprocess.run(words, cwd=self.folder, capture_output=True, text=True, check=False)

    def findings(self, command: str, *more: str) -> dict[str, str]:
        """What `doctor` found, by name; how many periods are missed is this computer's affair."""
        done = self.run(command, "--json", *more)
        assert done.stdout, done.stderr
        found = json.loads(done.stdout)
        assert not [each for each in found if each["state"] == FAIL and each["what"] != "rate"]
        return {each["what"]: each["found"] for each in found}


@pytest.fixture(scope="module")
def maker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Maker]:
    """The board is flashed by the page's commands, and wired with its switches."""
    folder = tmp_path_factory.mktemp("maker")
    programmer = folder / "bin" / "avrdude"
    programmer.parent.mkdir()
    programmer.write_text(AVRDUDE, encoding="utf-8")
    programmer.chmod(0o755)
    environment = {**os.environ, "PATH": f"{programmer.parent}:{os.environ['PATH']}"}
    words = [sys.executable, "-m", *shlex.split(EXPORT)]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)
    for command in (CHECK, FLASH):
        subprocess.run(shlex.split(command), cwd=folder, env=environment, check=True)
    convert = ["avr-objcopy", "-I", "ihex", "-O", "elf32-avr", "--rename-section"]
    convert += [".sec1=.text,contents,alloc,load,code", "flashed.hex", "flashed.elf"]
    subprocess.run(convert, cwd=folder, check=True)
    with simulated(folder, "--switches", program=folder / "flashed.elf") as port:
        yield Maker(folder, port)


@pytest.mark.slow
def test_the_flashed_board_answers_the_doctor(maker: Maker) -> None:
    assert f"-P {DEVICE}" in FLASH and "-p atmega328p" in FLASH
    found = maker.findings(OPEN)
    assert found["link"].startswith("an answer after ")
    assert found["channels"].startswith("encoder, limit_low, limit_high")


@pytest.mark.slow
def test_its_first_power_up(maker: Maker) -> None:
    found = maker.findings(WALK, "--yes")
    assert "limit_low and limit_high tripped, each at its end" in found["ends"]
    assert "heat" in found
    assert maker.findings(MOVE, "--yes")["killed process"].startswith("opened again after SIGKILL")


@pytest.mark.slow
def test_the_carriage_is_commissioned_runs_and_is_served(maker: Maker) -> None:
    done = maker.run(COMMISSION, "--yes")
    assert done.returncode == 0, done.stderr
    assert "verification: 7 of 7 moves arrived" in done.stdout
    file = maker.folder / "results" / "commission" / "machine.toml"
    travel = machine.load(file)[1].travel
    assert 0.15 < travel.high - travel.low < 0.21  # between the switches, 202 mm apart
    done = maker.run(RUN, "--yes")
    assert done.returncode == 0, done.stderr
    file.write_text(file.read_text("utf-8") + PATIENT, encoding="utf-8")
    served(maker, [*maker.words(SERVE), "--scpi", "0", "--web", "-1", "--state", "position.json"])


def served(maker: Maker, words: list[str]) -> None:
    """A client homes and moves it."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=maker.folder) as process:
        try:
            assert process.stdout is not None
            lines = (re.search(r"SCPI.*port (\d+)", line) for line in process.stdout)
            client = Client(("127.0.0.1", int(next(found for found in lines if found)[1])))
            client.socket.settimeout(DEADLINE)
            assert client.ask("SYST:LOCK:REQ?;:ENAB;:HOME;*OPC?") == "1;1"
            assert client.ask("MOVE:ABS 5 MM;*OPC?") == "1"
            assert client.ask("SYST:ERR:ALL?") == '0,"No error"'
            place, half, _ = client.ask("POS?").split(",")
            assert float(place) == pytest.approx(5.0, abs=4.0 * float(half))
            client.close()
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(DEADLINE) == 128 + signal.SIGTERM
