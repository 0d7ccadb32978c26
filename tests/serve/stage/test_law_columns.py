"""What a law of another package shows of its memory: in the ring, in records, to viewers."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from macromicro.columns import Column
from macromicro.control import outside
from macromicro.control.live.leading import REST, Course
from macromicro.control.settings import Control
from macromicro.machines import machine as machines
from macromicro.machines.period import Stages, law_columns
from macromicro.recording import Recording as Recorded
from macromicro.serve import settings
from macromicro.serve._ledger import Trail
from macromicro.serve._machine import View
from macromicro.serve._recording import Means, Recording
from macromicro.serve.settings import LiveSettings, load
from macromicro.serve.shared import COLUMNS, Shared, Vitals, telemetry, telemetry_of
from macromicro.serve.stage.rig import Guarded, Simulated
from macromicro.serve.web import bins
from macromicro.types import SAFE, Command, Sample

from ...control.own_laws import HERE

PRINTER = Path(__file__).parents[3] / "examples" / "machines" / "printer.toml"
SPEED = Column("law_speed", "mm/s", "filtered speed")
SLIDING = f"{HERE}:sliding"


def served(folder: Path) -> settings.StageSettings:
    text = PRINTER.read_text(encoding="utf-8")
    law = f'machine = "axis"\nlaw = "{HERE}:plain"\n'
    path = folder / "own.toml"
    path.write_text(
        text.replace('machine = "axis"\n', law) + '[own]\nreach = "4.5 V"\nslope = "500 1/s"\n',
        encoding="utf-8",
    )
    found = settings.load(path)
    assert found is not None
    return found


def row(own: list[float]) -> list[float]:
    nothing = (math.nan,) * 6
    view = View(0, 0, *nothing[:6])
    made = telemetry(Sample(*nothing), Command(*nothing[:5]), SAFE, view, Vitals(0, 0, 0, 0))
    return [*made, *own]


def test_a_stage_tells_what_its_own_law_remembers(tmp_path: Path, monkeypatch) -> None:
    found = served(tmp_path)
    monkeypatch.setattr(
        "macromicro.serve.stage._control.check_law", lambda *_: None
    )  # it has no limit
    assert found.law_columns == (SPEED,)
    rig = Simulated(found.machine, found.tree, (found.live.pitch,), 0)

    class Session:
        channels, clock = rig.channels, rig.clock

    led = Guarded(Session(), rig)  # type: ignore[arg-type]
    assert led.own() == []
    course = Course(True, REST._replace(position=0.7e-3), restart=1)
    fastest = 0.0
    for _ in range(200):
        rig.drive((course,))
        if led.tripped:
            break
        (speed,) = led.own()
        assert speed == 1e3 * rig.control._memory[0].speed
        fastest = max(fastest, speed)
    assert fastest > 0.1
    rig.drive((Course(),))
    assert led.own() == []


def test_a_law_of_this_package_has_none() -> None:
    assert load(PRINTER).law_columns == ()
    assert LiveSettings().law_columns == ()


def test_of_the_two_stage_machine(tmp_path: Path) -> None:
    law = outside.find(SLIDING, "test")
    own = LiveSettings(controller=Control(macro_law=SLIDING, own=law.gains()))
    assert own.law_columns == (SPEED,)
    memory = law.memory(1.0, 0.25)
    assert outside.values((outside.Held(0.0, memory),)) == [250.0]
    assert outside.values(()) == []


def test_of_two_axes_each_has_its_letter() -> None:
    axis = machines.load(PRINTER)[0]
    law = outside.find(SLIDING, "test")
    found = law_columns(Stages((axis.kind, axis.kind), (law, axis.law), ("x", "y")))
    assert [c.name for c in found] == ["x_law_speed"]
    found = law_columns(Stages((axis.kind, axis.kind), (law, law), ("x", "y")))
    assert [c.name for c in found] == ["x_law_speed", "y_law_speed"]


def test_they_come_last() -> None:
    form = telemetry_of(stages=("",), law=(SPEED,))
    assert form.columns[-1] == SPEED and form.columns[: len(COLUMNS)] == COLUMNS
    kept = form.kept(("encoder",))
    assert [form.columns[k] for k in kept] == [*COLUMNS, SPEED]


def test_a_record_has_their_names_units_and_values(tmp_path: Path) -> None:
    form = telemetry_of(law=(SPEED,))
    memory = Shared.create(1000, form)
    recording = Recording(
        memory, Trail(), tmp_path / "a.h5", 10, {}, print, channels=("encoder",),
        means=Means(form),
    )  # fmt: skip
    for k in range(5):
        memory.put(row([float(k)]))
    recording.end()
    found = Recorded.load(tmp_path / "a.h5")
    assert found["law_speed"].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert found.columns[-1] == SPEED and "law_2" not in found


def test_viewers_get_them_behind_all_others() -> None:
    names = telemetry_of(law=(SPEED,)).names
    block = np.array([row([float(k)]) for k in range(4)]).T
    made = bins.Plots(names, 1.0, law=["law_speed"]).traces(block)
    assert len(made) == len(bins.CHANNELS) + 1 and made[-1].tolist() == [0.0, 1.0, 2.0, 3.0]
