"""The bench behind a card with a comedi driver: the library's calls answered by a shim in C."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import macromicro
from macromicro.errors import InputError
from macromicro.rig import _comedi
from macromicro.rig.cards import _rig as card_rig
from macromicro.rig.cards._rig import CardError
from macromicro.rig.opening import named, open_rig
from macromicro.types import SAFE
from tests.rig.cards.machine import Machine, library, moved, needs_c

pytestmark = needs_c

MIDDLE = 1 << 23
WIRING = f"""
card = "comedi"
device = "/dev/comedi0"
[inputs]
encoder = {{ subdevice = 4, channel = 1, zero = {MIDDLE}, reverse = true }}
hall = {{ subdevice = 0, channel = 0 }}
laser = {{ subdevice = 0, channel = 1, scale = "-1 mm/V" }}
extend = {{ subdevice = 2, channel = 3, invert = true }}
contract = {{ subdevice = 5, channel = 4 }}
[outputs]
motor = {{ subdevice = 1, channel = 0, scale = -1 }}
ctrl = {{ subdevice = 1, channel = 1 }}
fan = {{ subdevice = 3, channel = 0 }}
laser_reset = {{ subdevice = 5, channel = 5 }}
"""


class Board:
    """A MultiQ-3 of the shim, wired as above to a machine."""

    def __init__(self, shim: ctypes.CDLL) -> None:
        self.shim, self.machine, self.strange = shim, Machine(), 0
        self._kept = (
            ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_uint, ctypes.c_uint)(self._read),
            ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_uint, ctypes.c_uint)(self._write),
        )
        shim.shim_couple(*self._kept)
        shim.shim_refuse(-1)

    def _read(self, subdevice: int, channel: int) -> int:
        seen = self.machine.sample()
        if (subdevice, channel) == (0, 0):
            return _bits(seen.hall, 0x1FFF)
        if (subdevice, channel) == (0, 1):
            return _bits(-1e3 * seen.laser, 0x1FFF)
        if (subdevice, channel) == (4, 1):
            return int(MIDDLE - seen.encoder) % (1 << 24)
        if (subdevice, channel) == (2, 3):
            return 1 - int(seen.extend)
        if (subdevice, channel) == (5, 4):
            return int(seen.contract)
        self.strange += 1
        return 0

    def _write(self, subdevice: int, channel: int, data: int) -> None:
        volts = -5.0 + 10.0 * data / 0xFFF
        names = {(1, 0): ("motor", -volts), (1, 1): ("ctrl", volts)}
        names |= {(3, 0): ("fan", float(data)), (5, 5): ("laser_reset", float(data))}
        if (subdevice, channel) in names:
            self.machine.put(*names[subdevice, channel])
        else:
            self.strange += 1


def _bits(volts: float, largest: int) -> int:
    return round(min(max((volts + 5.0) / 10.0, 0.0), 1.0) * largest)


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return library("comedi_shim", tmp_path_factory.mktemp("shim"))


@pytest.fixture
def board(shim: ctypes.CDLL, monkeypatch: pytest.MonkeyPatch) -> Iterator[Board]:
    made = Board(shim)
    monkeypatch.setattr(_comedi, "library", lambda: _comedi.set_types(shim))
    monkeypatch.setattr(card_rig, "Deadlines", made.machine.clock())
    yield made
    assert made.strange == 0, "a terminal that is not wired"
    assert shim.shim_opened() == 0, "closed at the end"


def written(folder: Path, text: str = WIRING) -> str:
    path = folder / "card.toml"
    path.write_text(text)
    return str(path)


def test_readings_and_outputs_are_the_machine_s(board: Board, tmp_path: Path) -> None:
    fixture = open_rig(written(tmp_path))
    assert fixture.channels == ("encoder", "hall", "laser", "extend", "contract")
    with fixture.make(0) as rig:
        first = rig.read()
        true = board.machine.sample()
        assert first.encoder == true.encoder
        assert first.hall == pytest.approx(true.hall, abs=10.0 / 0x1FFF)
        assert (first.extend, first.contract) == (true.extend, true.contract)
        last = moved(rig, 3.0, 300)[-1]
        true = board.machine.sample()
        assert last.encoder > first.encoder + 100
        assert board.machine.outputs["motor"] == pytest.approx(3.0, abs=2e-3)
        rig.write(SAFE._replace(ctrl=1.0, fan=1.0))
        assert board.machine.outputs["ctrl"] == pytest.approx(1.0, abs=2e-3)
        assert board.machine.outputs["fan"] == 1.0
    assert board.machine.safe


def test_a_programme_reaches_its_places(board: Board, tmp_path: Path) -> None:
    (tmp_path / "moves.toml").write_text('[[moves]]\nmacro = ["10 mm", "4 mm"]\nhold = "0.3 s"\n')
    run = macromicro.run(tmp_path / "moves.toml", rig=written(tmp_path))
    assert run.attributes["finished"] == 1
    moves = macromicro.moves(run)
    assert [m.stage for m in moves] == ["macro", "macro"]
    assert run["macro_position"][-1] == pytest.approx(run["macro_reference"][-1], abs=1.0)
    assert run["macro_position"].max() > 2.0 * run["macro_position"][-1]
    assert board.machine.safe
    assert board.machine.written > 1000


def test_a_counter_overflows_and_counts_on() -> None:
    counter = card_rig.Counter(1 << 24, MIDDLE, 1.0)
    assert counter.count(MIDDLE + 5) == 5
    assert counter.count((1 << 24) - 1) == MIDDLE - 1
    assert counter.count(3) == MIDDLE + 3
    assert counter.count((1 << 24) - 2) == MIDDLE - 2
    down = card_rig.Counter(1 << 24, 0, -1.0)
    assert down.count((1 << 24) - 7) == 7


def test_a_voltage_at_the_end_of_its_range_is_no_value(
    board: Board, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_rig(written(tmp_path)).make(0) as rig:
        far = board.machine.sample()._replace(laser=6e-3)
        monkeypatch.setattr(board.machine, "sample", lambda: far)
        assert math.isnan(rig.read().laser)
        assert not math.isnan(rig.read().hall)


def test_what_is_no_number_makes_everything_safe(board: Board, tmp_path: Path) -> None:
    with open_rig(written(tmp_path)).make(0) as rig:
        rig.write(SAFE._replace(motor=2.0, fan=1.0))
        with pytest.raises(CardError, match=r"outputs.ctrl: illegal output nan"):
            rig.write(SAFE._replace(motor=2.0, ctrl=math.nan))
        assert board.machine.safe


def test_outputs_are_safe_though_one_subdevice_fails(board: Board, tmp_path: Path) -> None:
    rig = open_rig(written(tmp_path)).make(0)
    with rig:
        rig.write(SAFE._replace(motor=2.0, fan=1.0))
        board.shim.shim_refuse(1)
        with pytest.raises(CardError, match=r"outputs.motor: Input/output error"):
            rig.stop()
        assert board.machine.outputs["fan"] == 0.0, "the others are set all the same"
        board.shim.shim_refuse(4)
        with pytest.raises(CardError, match=r"inputs.encoder: Input/output error"):
            rig.read()
        board.shim.shim_refuse(2)
        with pytest.raises(CardError, match=r"inputs.extend: Input/output error"):
            rig.read()
        board.shim.shim_refuse(-1)
    assert board.machine.safe


def test_lines_that_go_both_ways_are_given_their_direction(board: Board, tmp_path: Path) -> None:
    with open_rig(written(tmp_path)).make(0):
        assert (board.shim.shim_direction(4), board.shim.shim_direction(5)) == (0, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("subdevice = 4", "subdevice = 0", "0 has analog inputs. Choose a subdevice wi"),
        ("subdevice = 4", "subdevice = 9", "encoder.subdevice: '9'; accepted: a whole number"),
        ("channel = 3", "channel = 16", "extend.channel: '16'"),
        ("channel = 0 }", 'channel = 0, reference = "x" }', "'x'; accepted: one of ground, common"),
        ("channel = 0 }", "channel = 0, range = 1 }", "hall.range: '1'"),
    ],
)
def test_what_the_device_does_not_have(
    board: Board, tmp_path: Path, old: str, new: str, message: str
) -> None:
    rig = open_rig(written(tmp_path, WIRING.replace(old, new, 1))).make(0)
    with pytest.raises(InputError) as caught, rig:
        pass
    assert message in str(caught.value)


def test_a_device_that_is_not_there(board: Board, tmp_path: Path) -> None:
    rig = open_rig(written(tmp_path, WIRING.replace("comedi0", "comedi1"))).make(0)
    with pytest.raises(CardError, match=r"/dev/comedi1: No such file .*comedi_config"), rig:
        pass


def test_its_counters_may_count_on(tmp_path: Path) -> None:
    assert open_rig(written(tmp_path)).counted is False
    assert open_rig(written(tmp_path, "keeps_count = true\n" + WIRING)).counted is True


def test_a_library_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ctypes.util.find_library", lambda name: None)
    rig: Any = named(written(tmp_path))(0)
    with pytest.raises(CardError, match="libcomedi was not found: install it"), rig:
        pass
