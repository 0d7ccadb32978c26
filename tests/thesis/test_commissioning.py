"""Both stages commissioned: what is done, kept, resumed and refused."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError, MacromicroError
from macromicro.identify import model_file
from macromicro.identify.result import Line, Result
from macromicro.plant import bench
from macromicro.recorded import columns_named
from macromicro.recording import Recording
from macromicro.rig.session import BENCH, KILN, Fixture
from macromicro.rig.twin import CompiledTwin
from macromicro.schema.par import changed
from macromicro.settings import Settings
from macromicro.thesis import collecting, commissioning
from macromicro.thesis.commissioning import ACTUATOR, CARRIAGE, OVEN
from macromicro.thesis.procedure import Lab
from macromicro.types import Outputs, Sample

MADE = Recording.from_arrays(
    columns_named("t", "motor"), [np.arange(3) * 1e-3, np.zeros(3)], 1e-3, {}
)
CHANNELS = Sample._fields[1:]


def rig(kind: str = BENCH, channels: tuple[str, ...] = CHANNELS) -> Fixture:
    return Fixture("mine", kind, lambda seed: None, channels, 1e-3)


def test_without_a_kiln_the_carriage_alone_is_identified() -> None:
    assert commissioning.parts(Lab()) == (CARRIAGE, OVEN, ACTUATOR)
    assert commissioning.parts(Lab(rigs=(rig(),))) == (CARRIAGE,)
    assert commissioning.parts(Lab(rigs=(rig(), rig(KILN)))) == (CARRIAGE, OVEN, ACTUATOR)


def test_a_rig_that_lacks_a_sensor_is_refused_before_it_moves(tmp_path: Path) -> None:
    lab = Lab(rigs=(rig(channels=("encoder",)),))
    with pytest.raises(InputError, match="laser"):
        commissioning.commission(lab, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def model(folder: Path, part: str, text: str) -> Path:
    place = folder / part / "model" / "model.toml"
    place.parent.mkdir(parents=True)
    place.write_text(text)
    return place


def test_the_machine_has_what_was_found_under_the_laws_that_use_it(tmp_path: Path) -> None:
    base = changed(Settings(), {"bench.carriage.mass": 0.7})
    found = model(
        tmp_path,
        "carriage",
        '[controller]\nmacro_law = "terminal"\nown = { push = "9.1 m/s^2/V" }\n',
    )
    tree = commissioning.machine(base, [found])
    assert (tree.controller.macro_law, tree.controller.micro_law) == ("terminal", "pid-heat")
    assert tree.controller.own.push == 9.1
    assert tree.bench.carriage.mass == 0.7
    sequence = tree.controller.sequence
    assert (sequence.overlap, sequence.dwell, sequence.wait) == (1, 0.05, 0.1)
    kiln = model(tmp_path, "kiln", "[table]\nlow = 1.0\n")  # no settings
    gains = Inverse()._replace(lag=1.5e-3)
    fine = model(tmp_path, "actuator", model_file.gains("", "fine", gains, "inverse"))
    tree = commissioning.machine(base, [found, kiln, fine])
    assert tree.controller.micro_law == "inverse" and tree.controller.fine.lag == 1.5e-3
    assert tree.controller.own.push == 9.1


class Turned(CompiledTwin):
    """A bench whose motor, or wire, is connected the wrong way."""

    motor, ctrl = 1.0, 1.0

    def write(self, outputs: Outputs) -> None:
        ctrl = outputs.ctrl if self.ctrl > 0.0 else 0.0
        super().write(outputs._replace(motor=self.motor * outputs.motor, ctrl=ctrl))


@pytest.mark.parametrize(
    ("motor", "ctrl", "words"),
    [
        (1.0, 1.0, ""),
        (-1.0, 1.0, "direction: .*counts must rise"),
        (0.1, 1.0, "direction: 5 V.*it does not move"),
        (1.0, 0.0, "heat: .*it does not contract"),
    ],
)
def test_a_stage_that_goes_the_wrong_way_ends_it(
    motor: float, ctrl: float, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = bench.prepare(Settings().bench, Settings().sensors)
    monkeypatch.setattr(Turned, "motor", motor)
    monkeypatch.setattr(Turned, "ctrl", ctrl)
    turned = rig()._replace(make=lambda seed: Turned(plant, seed))
    if words:
        with pytest.raises(MacromicroError, match=words):
            commissioning._directions(turned)
        return
    said = commissioning._directions(turned)
    assert said[0].startswith("direction: 3.5 V: +") and said[1].startswith("heat: 1.6 V")


class Counted:
    """A part whose procedure and identification count how often they are called."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.collected, self.identified, self.broken = 0, 0, False
        procedure = collecting.Procedure("own", self.collect, (), "needs", "gives")
        monkeypatch.setattr(commissioning.collecting, "find", lambda name: procedure)
        monkeypatch.setattr(commissioning, "from_files", self.identify)

    def collect(self, lab: Lab) -> dict[str, Recording]:
        self.collected += 1
        return {"own": MADE}

    def identify(self, kind: str, files: list[Path], **options: Any) -> Result:
        self.identified += 1
        assert (kind, [f.name for f in files], options) == ("drive", ["own.h5"], {"gain": 2.0})
        if self.broken:
            raise InputError("own.h5", "nothing", "something")
        return Result("drive", "a part", None, [Line("b", 1.0, math.nan)], [], "", dict)


def test_what_is_complete_is_not_done_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    it, said = Counted(monkeypatch), []
    part = commissioning.Part("own", "drive", "*.h5", lambda parts: {"gain": 2.0})

    def do() -> Any:
        return commissioning._compute_once(
            Lab(), part, tmp_path, lambda *words: said.append(words), lambda name: None
        )

    it.broken = True
    with pytest.raises(InputError):
        do()
    it.broken = False
    assert do()["values"][0]["name"] == "b"
    assert (it.collected, it.identified) == (1, 2), "a day in the kiln is not lost by a bad fit"
    assert do()["kind"] == "drive"
    assert (it.collected, it.identified) == (1, 2)
    assert said == [("own", "gives; needs")]


def test_another_machine_or_seed_does_not_go_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    commissioning._same(Lab(), out)
    commissioning._same(Lab(), out)
    for other in (
        Lab(seed=1),
        Lab(changed(Settings(), {"bench.carriage.mass": 0.7})),
        Lab(rigs=(rig(),)),
    ):
        with pytest.raises(InputError, match="begun with another rig or seed"):
            commissioning._same(other, out)
    assert json.loads((out / commissioning.ASKED).read_text())["rigs"] == ["twin"]
