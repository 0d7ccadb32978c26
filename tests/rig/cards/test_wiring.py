"""The file of a card's wiring: what it gives, and what is said where it is wrong."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from macromicro.errors import InputError
from macromicro.rig.cards._wiring import read_wiring
from macromicro.rig.opening import CARDS, Carded, named, open_rig

KEYS = {name: card.KEYS for name, card in CARDS.items()}
HEAD = 'card = "comedi"\ndevice = "/dev/comedi0"\n'
PLACE = "subdevice = 0, channel = 0"


PAGE = (Path(__file__).parents[3] / "docs" / "rigs.md").read_text(encoding="utf-8")


def given(folder: Path, text: str) -> Path:
    path = folder / "card.toml"
    path.write_text(text)
    return path


def test_a_kiln_s_card(tmp_path: Path) -> None:
    text = (
        'kind = "kiln"\nrest = "10 min"\npitch = "10 um"\ndt = "0.1 s"\nkeeps_count = true\n'
        f'[inputs.thermocouple]\n{PLACE.replace(", ", chr(10))}\nscale = "100 K/V"\n'
        'offset = "-2 degC"\n'
        f"[inputs.encoder]\nsubdevice = 4\nchannel = 1\nzero = 7\n"
        f"[outputs.heater]\nsubdevice = 3\nchannel = 2\n"
    )
    wired = read_wiring(given(tmp_path, HEAD + text), KEYS)
    warm, count = wired.inputs
    assert (warm.scale, warm.offset) == (100.0, -2.0)
    assert (count.scale, count.offset, dict(count.at)) == (1.0, 7.0, {"subdevice": 4, "channel": 1})
    assert (wired.rest, wired.pitch, wired.dt, wired.keeps_count) == (600.0, 1e-5, 0.1, True)
    fixture = open_rig(str(tmp_path / "card.toml"))
    assert (fixture.kind, fixture.dt, fixture.rest, fixture.counted) == ("kiln", 0.1, 600.0, True)
    assert fixture.pitch == 1e-5


def test_what_is_left_out(tmp_path: Path) -> None:
    wired = read_wiring(given(tmp_path, f"{HEAD}[inputs]\nhall = {{ {PLACE} }}"), KEYS)
    assert (wired.kind, wired.dt, wired.rest, wired.outputs) == ("bench", 1e-3, 0.0, ())
    assert math.isnan(wired.pitch)
    assert (wired.inputs[0].scale, wired.inputs[0].offset) == (1.0, 0.0)


def test_the_table_of_its_hall_sensor_lies_beside_it(tmp_path: Path) -> None:
    (tmp_path / "hall.csv").write_text("hall_V,position_mm\n1.0,0.0\n2.0,2.0\n3.0,4.0\n")
    text = f'{HEAD}calibration = "hall.csv"\n[inputs]\nhall = {{ {PLACE} }}'
    wired = read_wiring(given(tmp_path, text), KEYS)
    assert wired.calibration is not None
    (tmp_path / "hall.csv").unlink()
    with pytest.raises(InputError, match=r"hall.csv"):
        read_wiring(tmp_path / "card.toml", KEYS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "inputs: there are none. Add a table such as [inputs.encoder]"),
        ("wires = 3", "wires: unknown key"),
        ('kind = "oven"', "kind: 'oven'; accepted: one of bench, kiln, cycle"),
        ("rest = 3", "rest: '3'; accepted: text with a unit, such as '1 s'"),
        ('rest = "-3 s"', "rest: '-3 s'; accepted: a time, 0 s or more"),
        ("keeps_count = 1", "keeps_count: '1'; accepted: true or false"),
        ("calibration = 3", "calibration: '3'; accepted: name of a file"),
        ("inputs = 3", "inputs: '3'; accepted: a table"),
        ("[inputs]\nhall = 3", "inputs.hall: '3'; accepted: a table"),
        (f"[inputs]\nsmell = {{ {PLACE} }}", "inputs.smell: unknown key"),
        (f"[inputs]\nindex_count = {{ {PLACE} }}", "inputs.index_count: unknown key"),
        (f"[outputs]\nhall = {{ {PLACE} }}", "outputs.hall: unknown key"),
        (f"[inputs]\nhall = {{ {PLACE}, invert = true }}", "inputs.hall.invert: unknown key"),
        (f"[inputs]\nhall = {{ {PLACE}, scale = 0 }}", "hall.scale: '0'; accepted: a number other"),
        (
            f"[inputs]\nlaser = {{ {PLACE} }}",
            "laser.scale: it is missing. Give text with a unit, suc",
        ),
        (f'[inputs]\nlaser = {{ {PLACE}, scale = "1 V" }}', "inputs.laser.scale: '1 V'"),
        (
            f"[inputs]\nlaser = {{ {PLACE}, scale = 1 }}",
            "laser.scale: '1'; accepted: text with a u",
        ),
        (f'[inputs]\nhall = {{ {PLACE}, offset = "1 mm" }}', "inputs.hall.offset: '1 mm'"),
        (
            f"[inputs]\nextend = {{ {PLACE}, invert = 1 }}",
            "extend.invert: '1'; accepted: true or f",
        ),
        (f"[inputs]\nencoder = {{ {PLACE}, reverse = 1 }}", "encoder.reverse: '1'"),
        (f"[inputs]\nencoder = {{ {PLACE}, zero = -1 }}", "encoder.zero: '-1'"),
        (f"[inputs]\nencoder = {{ {PLACE}, range = 1 }}", "encoder.range: unknown key"),
    ],
)
def test_what_is_wrong_with_it(tmp_path: Path, text: str, message: str) -> None:
    path = given(tmp_path, HEAD + text)
    with pytest.raises(InputError) as caught:
        read_wiring(path, KEYS)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ('device = "x"', "card: 'nothing'; accepted: one of comedi, nidaqmx"),
        ('card = "pigpio"\ndevice = "x"', "card: 'pigpio'"),
        ('card = "comedi"', "device: 'nothing'"),
        ('card = "comedi"\ndevice = 3', "device: '3'"),
    ],
)
def test_which_card_must_be_said(tmp_path: Path, head: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        named(str(given(tmp_path, head))).check()
    assert message in str(caught.value)


@pytest.mark.parametrize("k", [0, 1])
def test_the_page_s_files_are_read(tmp_path: Path, k: int) -> None:
    (tmp_path / "hall_calibration.csv").write_text("hall_V,position_mm\n1,0\n2,2\n3,4\n")
    shown = re.findall(r"```toml\n(card = .*?)```", PAGE, re.DOTALL)
    wired = read_wiring(given(tmp_path, shown[k]), KEYS)
    assert {t.name for t in wired.outputs} >= {"motor"}
    assert wired.rest == (600.0, 0.0)[k]


def test_a_bench_has_one_period(tmp_path: Path) -> None:
    given(tmp_path, f'{HEAD}dt = "2 ms"\n[inputs]\nhall = {{ {PLACE} }}')
    with pytest.raises(InputError, match=r"dt: '0\.002 s'; accepted: 0\.001 s for a bench"):
        open_rig(str(tmp_path / "card.toml"))
    assert str(Carded(tmp_path / "card.toml")) == str(tmp_path / "card.toml")
