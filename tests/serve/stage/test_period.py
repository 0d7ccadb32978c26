"""Machines of one stage served at control periods other than 1 ms: what clients are told, and what
is recorded, goes by the loop's own period."""

from __future__ import annotations

import os
import re
import sys
import time
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from tests.serve.stage.bed import Bed
from tests.serve.stage.test_lines import ALL
from tests.serve.stage.test_served import example, served

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.control.live.parameters import SoftLimits
from macromicro.errors import InputError
from macromicro.machines import piezo
from macromicro.recording import Recording
from macromicro.serve import settings
from macromicro.serve._programmes import OneStage
from macromicro.serve.settings import ServeSettings, problems
from macromicro.serve.station import Station


def at(period: str, name: str) -> str:
    """An example with another control period."""
    return re.sub(r"(\[timing\]\nperiod = ).*", rf'\1"{period}"', example(name))


def written(folder: Path, period: str, name: str, more: str = "") -> Path:
    file = folder / "axis.toml"
    file.write_text(at(period, name) + more, encoding="utf-8")
    return file


def homing(bed: Bed) -> tuple[m.Finished, float]:
    """The end of a homing, and for how long it stood: its law winds up as slowly as its period."""
    assert isinstance(bed.ask(m.Home()), Accepted)
    places = []
    while not (ends := [n for n in bed.notices if isinstance(n, m.Finished)]):
        bed.run(1)
        places.append(bed.machine.state.seen.encoder)
    lowest = min(places)
    stood = [(place, len(list(same)) * bed.period) for place, same in groupby(places)]
    return ends[0], sum(t for place, t in stood if t > 0.045 or place <= lowest + 2.0)


def test_motions_take_as_long_as_at_another_period(tmp_path: Path) -> None:
    took = []
    for period in ("1 ms", "2 ms", "5 ms"):
        bed = Bed(written(tmp_path, period, "printer"))
        assert bed.period == pytest.approx(1e-3 * float(period.split()[0]))
        assert isinstance(bed.ask(m.Enable()), Accepted)
        homed, leaning = homing(bed)
        moved = bed.end(m.MoveTo(0.2))
        assert isinstance(bed.ask(m.Jog("macro", -0.03)), Accepted)
        bed.run(round(0.5 / bed.period))
        assert isinstance(bed.ask(m.Stop()), Accepted)
        bed.run(round(1.0 / bed.period))
        ends = (homed, moved)
        assert [end.outcome for end in ends] == [m.DONE, m.DONE] and bed.fault is None
        assert bed.machine.state.seen.position == pytest.approx(0.2 - 0.03 * 0.5, abs=2e-3)
        assert bed.machine.view().motion == 0
        took.append([homed.evidence["seconds"] - leaning, moved.evidence["seconds"]])
    # The slow touch creeps count by count, and how long it sticks at each depends on the law.
    homing_s, moving_s = zip(*took, strict=True)
    assert max(homing_s) <= homing_s[0] * 1.05
    assert moving_s[1] == pytest.approx(moving_s[0], rel=0.05)


@pytest.mark.parametrize("period", ["2 ms", "5 ms"])
def test_homing_on_a_switch_is_as_near_as_a_period_tells(period: str, tmp_path: Path) -> None:
    """The slower it looks, the slower it touches: a period's way is what the edge scatters by."""
    text = ALL.format(on="home", home="cam", pulse="turn")
    file = tmp_path / "axis.toml"
    file.write_text(f'machine = "axis"\n{text}\n[timing]\nperiod = "{period}"\n', "utf-8")
    bed = Bed(file)
    assert f"{1e3 * bed.period:g} ms" == period
    assert isinstance(bed.ask(m.Enable()), Accepted)
    end = bed.end(m.Home())
    assert end.outcome == m.DONE and bed.fault is None, (end, bed.fault)
    assert abs(bed.machine.view().offset) * bed.pitch <= 30e-6 + 2.0 * bed.pitch


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "period", "loop"), [("printer", "2 ms", 2e-3), ("screw", "0.3 ms", 1.2e-3)]
)
def test_an_axis_is_served_at_its_own_period(
    name: str, period: str, loop: float, tmp_path: Path
) -> None:
    with served(tmp_path, at(period, name)) as client:
        assert client.ask("SYST:LOCK:REQ?") == "1"
        assert float(client.ask("WAV:INT?")) == pytest.approx(loop)
        client.send("ENAB")
        assert client.ask("HOME;*OPC?") == "1"
        client.send("REC ON,'own'")
        began = time.monotonic()
        for target in (70.0, 20.0):
            assert client.ask(f"MOVE:ABS {target} MM;*OPC?") == "1"
            assert client.mm() == pytest.approx(target, abs=0.1)
        took = time.monotonic() - began
        values = client.ask("WAV:DATA? position,0.5").split(",")
        assert len(values) == round(0.5 / loop)
        client.send("REC OFF")
        client.fine()
    found = Recording.load(tmp_path / "results" / "serve" / "own.h5")
    assert found.dt == pytest.approx(loop)
    t = found["t"]
    assert np.allclose(np.diff(t), loop)
    assert t[-1] - t[0] == pytest.approx(took, abs=2.0)


RIG = """
from pathlib import Path
from macromicro.machines import machine, rig

def bench(seed):
    own, tree = machine.load(Path("axis.toml"))
    return rig.CompiledTwin(own.kind, tree, seed)

def slower(seed):
    made = bench(seed)
    made.dt = 5e-3
    return made
"""


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    name = f"period{os.getpid()}"
    (tmp_path / f"{name}.py").write_text(RIG, encoding="utf-8")
    return name


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "period", "loop"), [("printer", "2 ms", 2e-3), ("screw", "0.25 ms", 1e-3)]
)
def test_a_rig_is_served_at_its_own_period(
    name: str, period: str, loop: float, lab: str, tmp_path: Path
) -> None:
    found = settings.load(written(tmp_path, period, name))
    patience = {"loop_timeout": 5.0, "parent_timeout": 5.0, "client_timeout": 60.0}
    patient = found._replace(serve=found.serve._replace(miss_share=1.0, **patience))
    with Station(f"{lab}:bench", settings=patient, state=tmp_path / "p.json") as station:
        station.acquire("a test")
        station.request("a test", m.Enable())
        for request in (m.Home(), m.MoveTo(0.02)):
            reply = station.request("a test", request)
            assert isinstance(reply, Accepted), reply
            end = station.finished(reply.id, 60.0)
            assert end is not None and end.outcome == m.DONE
        assert end.position == pytest.approx(0.02, abs=found.tree.arrival.tolerance)
        _, rows, names = station.telemetry()
    t = rows[list(names).index("t")]
    assert np.allclose(np.diff(t), loop)


def test_a_rig_of_another_period_is_refused_with_both(lab: str, tmp_path: Path) -> None:
    found = settings.load(written(tmp_path, "2 ms", "printer"))
    with pytest.raises(InputError, match=r"timing.period: '0.002 s'; accepted: 0.005 s, the perio"):
        Station(f"{lab}:slower", settings=found, state=tmp_path / "p.json").start()


@pytest.mark.parametrize(
    ("serve", "told"),
    [
        ('miss_share = 0.01\nmiss_window = "0.1 s"', r"miss_share: 0.01.*2 ms"),
        ('loop_timeout = "0.1 s"', ""),
    ],
)
def test_a_server_that_is_too_strict_for_the_period_is_refused(
    serve: str, told: str, tmp_path: Path
) -> None:
    file = written(tmp_path, "2 ms", "printer", f"\n[serve]\n{serve}\n")
    if not told:
        assert settings.load(file).period == 2e-3
        return
    with pytest.raises(InputError, match=rf"axis.toml, serve.{told}"):
        settings.load(file)


@pytest.mark.parametrize("name", ["loop_timeout", "parent_timeout", "reply_timeout"])
def test_silence_is_five_periods_or_more(name: str) -> None:
    plain = ServeSettings()
    assert list(problems(plain, 0.1)) == []
    given = plain._replace(**{name: 0.2})
    assert list(problems(given, 0.04)) == []
    ((where, value, accepted),) = problems(given, 0.0401)
    assert where == f"serve.{name}" and value == "200 ms"
    assert accepted == "200.5 ms or more, 5 periods at a period of 40.1 ms"


def test_a_live_profile_lasts_some_periods_of_the_loop(tmp_path: Path) -> None:
    path, tree = tmp_path / "p.toml", piezo.DEFAULT
    path.write_text(
        '[[profiles]]\nto = "10 um"\nvelocity = "1 m/s"\nacceleration = "100 m/s^2"\n'
        'jerk = "9.4815e4 m/s^3"\nhold = "5 ms"\n'
    )
    soft = SoftLimits(whole_low=0.0, whole_high=tree.travel.high)
    with pytest.raises(InputError, match=r"1\.5 ms; at least 5 ms \(5 control periods of 1 ms\)"):
        OneStage(tree).read(path, soft)
