"""A served axis with switches and drive lines: homing, faults, the way back, what is shown."""

from __future__ import annotations

import math
import os
import sys
import time
from itertools import pairwise
from pathlib import Path

import pytest
from tests.serve.stage.bed import Bed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.errors import InputError
from macromicro.nominal import PERIOD
from macromicro.place import LENGTH
from macromicro.rig.session import Session
from macromicro.serve import settings, shared
from macromicro.serve.shared import LAMPS, LINES
from macromicro.serve.stage import opening
from macromicro.serve.stage.rig import Guarded
from macromicro.serve.station import Station

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"
ALL = """
[switches]
limits = "both"
home = "{home}"
[homing]
on = "{on}"
[amplifier]
enable = "line"
fault = "line"
enable_time = "10 ms"
[encoder]
index_pulse = "{pulse}"
"""


def written(
    folder: Path, on: str, home: str = "below", pulse: str = "turn", more: str = "",
    machine: str = "axis",
) -> Path:  # fmt: skip
    file = folder / "axis.toml"
    text = ALL.format(on=on, home=home, pulse=pulse)
    file.write_text(f'machine = "{machine}"\n{text}{more}', encoding="utf-8")
    return file


WAYS = [
    ("stop", "below", "turn", 0.05),
    ("limit", "below", "turn", 30e-6),
    ("home", "below", "turn", 30e-6),
    ("home", "cam", "turn", 30e-6),
    ("limit+index", "below", "turn", 0.0),
    ("home+index", "cam", "turn", 0.0),
    ("home+index", "below", "mark", 0.0),
    ("index", "below", "mark", 0.0),
]


@pytest.mark.parametrize(("on", "home", "pulse", "off"), WAYS)
def test_it_homes_by_each_way(tmp_path: Path, on: str, home: str, pulse: str, off: float) -> None:
    bed = Bed(written(tmp_path, on, home, pulse))
    assert bed.line("enable") == 0.0 == bed.line("enabled")
    assert isinstance(bed.ask(m.Enable()), Accepted)
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and bed.fault is None, (end, bed.fault)
    assert abs(bed.machine.view().offset) * bed.pitch <= off + 2.0 * bed.pitch * (off > 0.0)
    assert bed.end(m.MoveTo(0.06)).outcome == m.DONE
    assert bed.place == pytest.approx(0.06, abs=max(off, bed.tree.arrival.tolerance) + 1e-4)
    assert bed.line("enable") == 1.0 == bed.line("enabled")


@pytest.mark.parametrize(
    ("on", "home", "pulse", "off"),
    [
        pytest.param("limit", "below", "turn", 5e-4, marks=pytest.mark.slow),
        pytest.param("home", "cam", "turn", 5e-4, marks=pytest.mark.slow),
        pytest.param("home+index", "cam", "turn", 0.0, marks=pytest.mark.slow),
        pytest.param("index", "below", "mark", 0.0, marks=pytest.mark.slow),
    ],
)
def test_one_that_turns_homes_by_each_way(
    tmp_path: Path, on: str, home: str, pulse: str, off: float
) -> None:
    """Its switches scatter by 5 mdeg, a count is 9 mdeg."""
    bed = Bed(written(tmp_path, on, home, pulse, machine="rotary"))
    assert isinstance(bed.ask(m.Enable()), Accepted)
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and bed.fault is None, (end, bed.fault)
    assert abs(bed.machine.view().offset) * bed.pitch <= off + 2.0 * bed.pitch * (off > 0.0)
    assert bed.end(m.MoveTo(2.0)).outcome == m.DONE
    assert bed.place == pytest.approx(2.0, abs=max(off, bed.tree.arrival.tolerance) + 1e-3)
    bed.ask(m.Jog("macro", bed.machine._p.settings.jogging.slow))
    bed.run(20)
    assert (bed.line("limit_low"), bed.line("limit_high")) == (0.0, 0.0)


@pytest.mark.slow
def test_a_jog_into_the_limit_switch_of_one_that_turns_is_a_fault_too(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, "limit+index", machine="rotary"))
    bed.ask(m.Enable())
    bed.ask(m.Jog("macro", -bed.machine._p.settings.jogging.slow))
    while bed.fault is None:
        bed.run(1)
    assert bed.fault.code == 208 and bed.fault.name == "lower limit switch"
    assert "deg" in bed.fault.evidence and "mm" not in bed.fault.evidence
    assert bed.tree.load.stop_low < bed.place <= bed.tree.switches.low + 1e-3
    bed.run(20)
    assert bed.line("enable") == 0.0 and bed.line("limit_low") == 1.0
    bed.clear()
    assert isinstance(bed.ask(m.Enable()), Accepted)
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and bed.fault is None, (end, bed.fault)


def test_a_jog_into_the_limit_switch_is_a_fault_and_it_leaves_slowly(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, "home+index", more='[motion]\nvelocity = "0.5 m/s"\n'))
    bed.ask(m.Enable())
    # It is not homed: nothing but the switch knows where the way ends.
    bed.ask(m.Jog("macro", -bed.machine._p.settings.jogging.slow))
    while bed.fault is None:
        bed.run(1)
    assert bed.fault.code == 208 and bed.fault.name == "lower limit switch"
    assert bed.tree.load.stop_low < bed.place <= bed.tree.switches.low + 1e-5
    bed.run(20)
    assert bed.line("enable") == 0.0 and bed.rig.control.efforts == [0.0]
    bed.clear()
    assert isinstance(bed.ask(m.Enable()), Accepted)
    bed.run(100)
    assert bed.fault is None and bed.line("limit_low") == 1.0
    # No farther: it pushes no harder than friction holds.
    before = bed.place
    bed.ask(m.Jog("macro", -0.05))
    bed.run(400)
    assert bed.fault is None and bed.place == pytest.approx(before, abs=2e-5)
    bed.ask(m.Stop())
    bed.run(500)
    bed.ask(m.Jog("macro", 0.05))
    places = []
    while bed.line("limit_low") == 1.0:
        places.append(bed.place)
        bed.run(1)
    fastest = max(b - a for a, b in pairwise(places)) / PERIOD
    assert fastest < 1.3 * bed.tree.switches.leave
    bed.ask(m.Stop())
    bed.run(500)
    assert bed.fault is None
    assert bed.end(m.Home()).outcome == m.DONE
    # Homed, it goes anywhere at once.
    assert bed.end(m.MoveTo(0.2)).outcome == m.DONE


def test_homing_from_the_limit_switch_is_allowed(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, "limit+index"))
    bed.ask(m.Enable())
    bed.ask(m.Jog("macro", -bed.machine._p.settings.jogging.slow))
    while bed.fault is None:
        bed.run(1)
    bed.clear()
    bed.ask(m.Enable())
    assert bed.end(m.Home()).outcome == m.DONE and bed.machine.view().offset == 0.0


def test_a_homed_stage_that_was_pushed_onto_a_switch_comes_back(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, "home+index"))
    bed.ask(m.Enable())
    bed.end(m.Home())
    bed.ask(m.Disable())
    here = bed.rig._states[0].axis.x
    for k in range(100):  # by hand, below the soft limit and the switch
        s, x = bed.rig._states[0], here + (k + 1) / 100 * (-4e-3 - here)
        bed.rig._states = (s._replace(axis=s.axis._replace(x=x, xm=x)),)
        bed.run(1)
    bed.run(50)
    assert bed.line("limit_low") == 1.0
    bed.ask(m.Enable())
    bed.run(50)
    assert bed.fault is None
    assert bed.end(m.MoveTo(0.05)).outcome == m.DONE
    assert bed.fault is None


def test_a_drive_that_trips_is_a_fault_with_its_words_until_it_has_cooled(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, "home+index"))
    bed.ask(m.Enable())
    bed.end(m.Home())
    s = bed.rig._states[0]
    bed.rig._states = (s._replace(drive=s.drive._replace(heat=1.5)),)
    bed.run(5)
    assert bed.fault.code == 211 and bed.fault.name == "drive fault"
    assert "clear the fault and enable" in bed.fault.remedy
    bed.clear()
    bed.ask(m.Enable())
    bed.run(20)
    assert bed.fault is not None and bed.fault.code == 211  # still hot
    bed.clear()
    bed.run(6000)
    bed.ask(m.Enable())
    bed.run(20)
    assert bed.fault is None and bed.end(m.MoveTo(0.1)).outcome == m.DONE


def test_telemetry_and_records_have_the_lines_that_there_are(tmp_path: Path) -> None:
    one = shared.telemetry_of(stages=("",))
    found = [one.names[k] for k in one.kept(("encoder", "home", "enable"))]
    assert found == [*shared.NAMES, "home", "enable"]
    assert [one.names[k] for k in one.kept(("encoder",))] == [*shared.NAMES]
    several = shared.telemetry_of((LENGTH,) * 3, ("x", "y", "z"))
    assert not set(LINES) & set(several.names)
    assert [n for n in several.names if n.startswith("z_")] == [
        *("z_count", "z_reference", "z_motor", "z_position", "z_uncertainty")
    ]
    bed = Bed(written(tmp_path, "home+index", more='[climate]\nstart = "23 degC"\nsensor = 1\n'))
    assert len(bed.led.lines()) == len(LINES)
    seen = dict(zip(LINES, bed.led.lines(), strict=True))
    assert seen["limit_low"] == 0.0 and math.isnan(seen["index_count"])
    assert seen["temperature"] == 23.0
    assert bed.rig.channels == ("encoder", *LINES)


RIG = """
from pathlib import Path
from macromicro.machines import machine, rig

FILE = Path({file!r})

def bench(seed):
    own, tree = machine.load(FILE)
    return rig.CompiledTwin(own.kind, tree, seed)

def bare(seed):
    made = bench(seed)
    made.channels = ("encoder", "limit_low", "limit_high")
    return made
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, Path]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    name = f"lined{os.getpid()}"
    file = written(tmp_path, "home+index")
    (tmp_path / f"{name}.py").write_text(RIG.format(file=str(file)), encoding="utf-8")
    return name, file


def test_a_pulse_between_two_periods_of_the_loop_is_not_missed(tmp_path: Path) -> None:
    """On a rig that is read four times in each, and says it in one of these readings alone."""
    quick = '[timing]\nperiod = "0.25 ms"\ndelay = "0.05 ms"\n'
    bed = Bed(written(tmp_path, "home+index", more=quick), real=True)
    assert bed.rig.control.number == 4
    assert isinstance(bed.ask(m.Enable()), Accepted)
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and end.evidence["offset_raw_counts"] == 0.0


def test_a_rig_of_a_users_with_lines(lab: tuple[str, Path], tmp_path: Path) -> None:
    name, file = lab
    found = settings.load(file)
    assert found is not None
    patient = found._replace(
        serve=found.serve._replace(miss_share=1.0, loop_timeout=5.0, parent_timeout=5.0)
    )
    with Station(f"{name}:bench", settings=patient, state=tmp_path / "p.json") as station:
        station.acquire("a test")
        quiet = {
            "limit_low": False,
            "limit_high": False,
            "home": True,
            "drive_fault": False,
            "enabled": False,  # once the drive has seen a period without `enable`
            "enable": False,
        }
        end_at = time.monotonic() + 10.0
        while dict(station.snapshot().lines) != quiet and time.monotonic() < end_at:
            time.sleep(0.02)
        assert dict(station.snapshot().lines) == quiet
        station.record(tmp_path / "live.h5")
        station.request("a test", m.Enable())
        reply = station.request("a test", m.Home())
        assert isinstance(reply, Accepted), reply
        end = station.finished(reply.id, 60.0)
        assert end is not None and end.outcome == m.DONE
        assert end.evidence["offset_raw_counts"] == 0.0
        time.sleep(0.2)
        lines = dict(station.snapshot().lines)
        assert lines["enable"] and lines["enabled"] and not lines["limit_low"]
        station.end_recording()
    from macromicro.recording import Recording

    recording = Recording.load(tmp_path / "live.h5")
    assert set(LINES) - {"temperature"} <= {c.name for c in recording.columns}
    assert recording["enable"].max() == 1.0 and recording["home"].max() == 1.0
    with pytest.raises(
        InputError, match=r'channels: homing.on = "home.* needs home and index_count'
    ):
        Station(f"{name}:bare", settings=patient, state=tmp_path / "p.json").start()


def test_each_of_several_stages_shows_the_lines_that_its_settings_name(tmp_path: Path) -> None:
    file, plotter = tmp_path / "xy.toml", (EXAMPLES / "xy-plotter.toml").read_text("utf-8")
    drive = "[y.amplifier]\n", '[y.amplifier]\nenable = "line"\n'
    switches = '[x.switches]\nlimits = "low"\n[y.switches]\nhome = "cam"\n'
    file.write_text(plotter.replace(*drive) + switches, encoding="utf-8")
    found = settings.load(file)
    rig = opening.simulate(found, 0)
    rig.read()
    led = Guarded(Session(rig, found.period), rig, found.axes)

    def shown(stage: int) -> dict[str, float]:
        each = zip(LAMPS, led.lamps()[stage], strict=True)
        return {name: on for name, on in each if not math.isnan(on)}

    assert shown(0) == {"limit_low": 0.0} and list(shown(1)) == ["home", "enabled", "enable"]
    assert not shown(1)["enable"]
    rig.lines[0] = rig.lines[0]._replace(limit_low=math.nan)  # what cannot be read counts as on
    assert shown(0) == {"limit_low": 1.0}
