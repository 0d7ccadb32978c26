"""The bench behind a card of National Instruments: nidaqmx unmodified, its driver a shim in C."""

from __future__ import annotations

import builtins
import ctypes
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import macromicro
from macromicro.errors import InputError
from macromicro.rig.cards import _rig as card_rig
from macromicro.rig.cards._rig import CardError
from macromicro.rig.opening import open_rig
from macromicro.types import SAFE
from tests.rig.cards.machine import Machine, library, moved, needs_c

pytestmark = needs_c
_lib = pytest.importorskip("nidaqmx._lib", reason="pip install 'macromicro[nidaqmx]'")

WIRING = """
card = "nidaqmx"
device = "Dev1"
[inputs]
encoder = { line = "ctr0" }
laser = { line = "ai1", scale = "2 mm/V", offset = "1 mm" }
hall = { line = "ai0", range = "5 V", reference = "differential" }
contract = { line = "port0/line1", invert = true }
extend = { line = "port0/line0" }
[outputs]
fan = { line = "port0/line2", invert = true }
motor = { line = "ao0", offset = "-1 V", range = "5 V" }
ctrl = { line = "ao1", scale = 0.5 }
laser_reset = { line = "port0/line3" }
"""


class Board:
    """Dev1 of the shim, wired as above to a machine."""

    def __init__(self, shim: ctypes.CDLL) -> None:
        self.shim, self.machine = shim, Machine()
        shim.shim_asked.restype = ctypes.c_char_p
        self._kept = (
            ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_char_p)(self._read),
            ctypes.CFUNCTYPE(None, ctypes.c_char_p, ctypes.c_double)(self._write),
        )
        shim.shim_couple(*self._kept)
        shim.shim_refuse(b"")

    def _read(self, line: bytes) -> float:
        seen = self.machine.sample()
        values = {
            b"ctr0": float(int(seen.encoder) % (1 << 32)),
            b"ai0": seen.hall,
            b"ai1": (seen.laser - 1e-3) / 2e-3,
            b"port0/line0": seen.extend,
            b"port0/line1": 1.0 - seen.contract,
        }
        return values[line.removeprefix(b"Dev1/")]

    def _write(self, line: bytes, value: float) -> None:
        name, shown = {
            b"Dev1/ao0": ("motor", value - 1.0),
            b"Dev1/ao1": ("ctrl", 0.5 * value),
            b"Dev1/port0/line2": ("fan", 1.0 - value),
            b"Dev1/port0/line3": ("laser_reset", value),
        }[line]
        self.machine.put(name, shown)


def _same(shown: Any, true: Any) -> bool:
    return bool(tuple(shown) == pytest.approx(tuple(true), abs=1e-12, nan_ok=True))


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return library("nidaqmx_shim", tmp_path_factory.mktemp("shim"))


@pytest.fixture
def board(shim: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> Iterator[Board]:
    made, importer = Board(shim), _lib.lib_importer
    for name in ("_windll", "_cdll"):
        monkeypatch.setattr(importer, name, _lib.DaqFunctionImporter(shim))
    monkeypatch.setattr(importer, "_encoding", "utf-8")
    monkeypatch.setattr(card_rig, "Deadlines", made.machine.clock())
    yield made
    assert shim.shim_tasks() == 0, "every task is cleared at the end"


def written(folder: Path, text: str = WIRING) -> str:
    path = folder / "card.toml"
    path.write_text(text)
    return str(path)


def test_readings_and_outputs_are_the_machine_s(board: Board, tmp_path: Path) -> None:
    with open_rig(written(tmp_path)).make(0) as rig:
        assert board.machine.safe, "safe from the first, inverted lines and offsets too"
        assert _same(rig.read(), board.machine.sample())
        samples = moved(rig, 3.0, 300)
        assert samples[-1].encoder > samples[0].encoder + 100
        far = board.machine.sample()._replace(laser=math.nan)  # beyond 10 V
        assert _same(rig.read(), far)
        rig.write(SAFE._replace(motor=2.5, ctrl=1.2, fan=1.0, laser_reset=1.0))
        assert board.machine.outputs == pytest.approx(
            {"motor": 2.5, "ctrl": 1.2, "fan": 1.0, "laser_reset": 1.0}
        )
        rig.write(SAFE._replace(motor=20.0))
        assert board.machine.outputs["motor"] == 4.0, "cut at 5 V of the card"
        asked = board.shim.shim_asked().decode()
    assert "Dev1/ai0:10106:-5:5;" in asked, "differential"
    assert "Dev1/ai1:-1:-10:10;" in asked, "the card's own way"
    assert "Dev1/ctr0:10092:10304;" in asked, "four counts a period, in counts"
    assert board.machine.safe


def test_a_programme_reaches_its_places(board: Board, tmp_path: Path) -> None:
    (tmp_path / "moves.toml").write_text('[[moves]]\nmacro = ["10 mm"]\nhold = "0.3 s"\n')
    run = macromicro.run(tmp_path / "moves.toml", rig=written(tmp_path))
    assert run.attributes["finished"] == 1
    assert [m.stage for m in macromicro.moves(run)] == ["macro"]
    assert run["macro_position"][-1] == pytest.approx(run["macro_reference"][-1], abs=1.0)
    assert board.machine.safe


def test_a_voltage_at_the_end_of_its_range_is_no_value(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_rig(written(tmp_path)).make(0) as rig:
        far = board.machine.sample()._replace(hall=5.0, laser=7e-3)
        monkeypatch.setattr(board.machine, "sample", lambda: far)
        seen = rig.read()
    assert math.isnan(seen.hall)
    assert seen.laser == pytest.approx(7e-3)


def test_other_outputs_are_safe_though_one_task_fails(board: Board, tmp_path: Path) -> None:
    with open_rig(written(tmp_path)).make(0) as rig:
        rig.write(SAFE._replace(motor=2.0, fan=1.0))
        board.shim.shim_refuse(b"Dev1/ao0")
        with pytest.raises(CardError, match="NI-DAQmx, analog outputs: No transfer"):
            rig.stop()
        assert board.machine.outputs["fan"] == 0.0
        for line in (b"Dev1/ctr0", b"Dev1/ai1", b"Dev1/port0/line0"):
            board.shim.shim_refuse(line)
            with pytest.raises(CardError, match="NI-DAQmx, reading: No transfer"):
                rig.read()
        board.shim.shim_refuse(b"")
    assert board.machine.safe


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"Dev1"', '"Dev7"', "NI-DAQmx knows no device Dev7; it knows: Dev1, Dev2"),
        ('"ai0"', '"ai99"', "inputs.hall: Physical channel does not exist."),
        ('{ line = "ctr0" }', "{ zero = 1 }", "inputs.encoder.line: 'nothing'; accepted: the line"),
        ('"5 V", ref', '"-5 V", ref', "hall.range: '-5 V'; accepted: a voltage above 0 V"),
        ('"5 V", ref', "5, ref", "hall.range: '5'; accepted: the largest voltage both ways"),
        ('"differential"', '"both"', "hall.reference: 'both'; accepted: one of default, ground"),
    ],
)
def test_what_the_device_does_not_have(
    board: Board, tmp_path: Path, old: str, new: str, message: str
) -> None:
    rig = open_rig(written(tmp_path, WIRING.replace(old, new, 1))).make(0)
    with pytest.raises((InputError, CardError)) as caught, rig:
        pass
    assert message in str(caught.value)


def test_without_the_driver(tmp_path: Path) -> None:
    rig = open_rig(written(tmp_path)).make(0)
    with pytest.raises(CardError, match="Could not find an installation of NI-DAQmx"), rig:
        pass


def test_without_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = builtins.__import__

    def missing(name: str, *rest: Any) -> Any:
        if name.startswith("nidaqmx"):
            raise ModuleNotFoundError(name=name)
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", missing)
    rig = open_rig(written(tmp_path)).make(0)
    with pytest.raises(CardError, match=r"no package nidaqmx .*\[nidaqmx\]"), rig:
        pass


def test_its_counters_keep_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="keeps_count: 'true'; accepted: false with nidaqmx"):
        open_rig(written(tmp_path, "keeps_count = true\n" + WIRING))
