"""The live machine of two axes: straight lines, programmes in step, one motion of both."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from tests.serve.group.bed import PLOTTER, Bed

from macromicro.control.live import messages as m
from macromicro.control.live.alone import possible
from macromicro.control.live.messages import Accepted, Event, Refused
from macromicro.machines.guard_words import OTHER_AXIS
from macromicro.machines.guarding import OK
from macromicro.machines.joint import course, planning
from macromicro.serve import faults
from macromicro.serve.persist import Restored


@pytest.fixture(scope="module")
def shared() -> Bed:
    return Bed()


@pytest.fixture
def bed(shared: Bed) -> Bed:
    """Both axes at rest, enabled and known, wherever they stand."""
    assert shared.pair.view().motion == 0 and shared.pair.view().trusted == 1.0
    shared.notices, shared.places, shared.aims = [], [], []
    return shared


def test_both_home_and_only_then_the_place_is_trusted() -> None:
    bed = Bed(known=False)
    refused = bed.ask(m.MovePoint({"x": 0.05, "y": 0.03}))
    assert isinstance(refused, Refused) and refused.reason.startswith("x: ")
    assert bed.pair.view().trusted == 0.0
    end = bed.done(m.Home())
    assert end.outcome == m.DONE and bed.mode == "ready" and bed.pair.view().trusted == 1.0
    trust = [n for n in bed.notices if isinstance(n, Event) and n.kind == "trust"]
    assert [n.evidence["trusted"] for n in trust] == [False, False, False, True]
    assert trust[-1].cause == "homed" and trust[-2].cause == "x: homed"
    # Each axis knows where it stands, within a few counts of its own end stop.
    x, y = (led.state.seen.position for led in bed.pair._leds)
    true = [
        kind.show(params, state)[0]
        for kind, params, state in zip(
            bed.rig.control.kinds, bed.rig._bench.stages[:2], bed.rig._states, strict=True
        )
    ]
    # The stop gives way under the push of the touch: within its push over its stiffness.
    assert abs(x - true[0]) < 20e-6 and abs(y - true[1]) < 20e-6
    assert bed.pair.views()[1].offset != 0.0


def test_a_move_to_a_point_is_straight_and_both_arrive_together(bed: Bed) -> None:
    bed.done(m.MovePoint({"x": 0.020, "y": 0.010}))
    bed.aims, bed.notices = [], []
    end = bed.done(m.MovePoint({"x": 0.120, "y": 0.060}))
    assert end.outcome == m.DONE
    assert bed.place == pytest.approx((0.120, 0.060), abs=3e-6)
    aims = np.array(bed.aims)
    way = aims[(aims[:, 0] > 0.0201) & (aims[:, 0] < 0.1199)]
    assert len(way) > 100
    # On the line y = x / 2: nothing but what floating point leaves.
    assert np.abs(way[:, 1] - 0.5 * way[:, 0]).max() < 1e-9
    moving = np.abs(np.diff(aims, axis=0)) > 0.0
    first, last = ([np.flatnonzero(moving[:, k])[i] for k in (0, 1)] for i in (0, -1))
    assert first[0] == first[1] and last[0] == last[1]
    # It takes what the slower axis would take alone, within the limits of both.
    speed = np.diff(aims, axis=0) / 1e-3
    for k, own in enumerate((bed.tree.x, bed.tree.y)):
        assert np.abs(speed[:, k]).max() <= own.motion.velocity * (1 + 1e-6)
    piece = planning.line((0.020, 0.010), (0.120, 0.060))
    most = planning.limits(piece, bed.tree)
    assert np.hypot(*speed.T).max() == pytest.approx(most.speed, rel=1e-3)
    modes = [(n.from_mode, n.to_mode) for n in bed.notices if isinstance(n, Event)]
    assert modes == [("ready", "moving-macro"), ("moving-macro", "ready")]
    assert bed.notices[0].evidence["target_x_mm"] == pytest.approx(120.0)
    assert end.evidence["x_mm"] == pytest.approx(120.0, abs=3e-3)
    assert end.evidence["y_mm"] == pytest.approx(60.0, abs=3e-3)


def test_a_speed_of_one_axis_slows_both_down_on_a_line(bed: Bed) -> None:
    """They arrive together; alone, the other one goes as before."""
    bed.done(m.MovePoint({"x": 0.020, "y": 0.010}))
    most = bed.settings.facts.speeds
    assert bed.ask(m.SetSpeed("y", 0.1 * most["y"])) == Accepted()
    assert isinstance(bed.ask(m.SetSpeed("y", 1.1 * most["y"])), Refused)
    assert isinstance(bed.ask(m.SetSpeed("macro", 0.01)), Refused)
    told = [n.evidence for n in bed.notices if isinstance(n, Event) and n.kind == "speed"]
    assert told == [{"y_speed_m_per_s": 0.1 * most["y"], "client": ""}]
    bed.aims = []
    bed.done(m.MovePoint({"x": 0.060, "y": 0.030}))
    aims = np.array(bed.aims)
    assert np.abs(aims[:, 1] - 0.5 * aims[:, 0]).max() < 2e-6
    speed = np.abs(np.diff(aims, axis=0)).max(axis=0) / 1e-3
    assert speed == pytest.approx([0.2 * most["y"], 0.1 * most["y"]], rel=1e-3)
    bed.aims = []
    bed.done(m.MoveAxis("x", 0.120))
    assert np.abs(np.diff(bed.aims, axis=0)).max() / 1e-3 > 0.5 * most["x"]
    bed.ask(m.MoveAxis("x", 0.1))
    assert bed.ask(m.SetSpeed("y", most["y"])).reason == "a motion is under way"  # type: ignore[union-attr]
    bed.run(60000, to_end=True)
    assert bed.ask(m.SetSpeed("y", most["y"])) == Accepted()


def test_a_stop_on_the_way_stays_on_the_line(bed: Bed) -> None:
    bed.done(m.MovePoint({"x": 0.020, "y": 0.010}))
    bed.aims = []
    reply = bed.ask(m.MovePoint({"x": 0.120, "y": 0.060}))
    bed.run(120)
    assert bed.ask(m.MovePoint({"x": 0.0, "y": 0.0})) == Refused(
        "a motion is under way", "wait for its end, or stop it"
    )
    assert isinstance(bed.ask(m.MoveAxis("y", 0.0)), Refused)
    assert isinstance(bed.ask(m.Jog("y", 0.001)), Refused)
    bed.ask(m.Stop())
    assert bed.mode == "stopped"
    bed.run(3000, to_end=True)
    end = bed.notices[-1] if isinstance(bed.notices[-1], m.Finished) else bed.notices[-2]
    assert end.id == reply.id and end.outcome == m.STOPPED_BY_REQUEST
    aims = np.array(bed.aims)
    assert np.abs(aims[:, 1] - 0.5 * aims[:, 0]).max() < 2e-6  # it began within a count of it
    assert 0.02 < bed.place[0] < 0.11 and bed.pair.view().trusted == 1.0


def test_a_move_replaces_one_under_way(bed: Bed) -> None:
    """It brakes on its line, and the new one is a line from where both then rest."""
    bed.done(m.MovePoint({"x": 0.020, "y": 0.010}))
    first = bed.ask(m.MovePoint({"x": 0.120, "y": 0.060}))
    bed.run(120)
    bed.aims = []
    second = bed.ask(m.MovePoint({"x": 0.030, "y": 0.070}, "", True))
    assert isinstance(first, Accepted) and second == Accepted(first.id + 1)
    ends = [n for n in bed.notices if isinstance(n, m.Finished)]
    assert (ends[-1].id, ends[-1].outcome) == (first.id, m.SUPERSEDED)
    assert ends[-1].evidence == {"kind": "move to point", "by": "move to point"}
    assert bed.pair.view().motion == second.id
    bed.run(5)
    again = bed.ask(m.MoveAxis("x", 0.0, "", True))
    assert isinstance(again, Refused) and "coming to rest" in again.reason
    bed.run(60000, to_end=True)
    end = next(n for n in bed.notices[::-1] if isinstance(n, m.Finished))
    assert (end.id, end.outcome) == (second.id, m.DONE) and bed.mode == "ready"
    assert bed.place == pytest.approx((0.030, 0.070), abs=3e-6)
    aims = np.array(bed.aims)
    turn = int(np.argmax(aims[:, 0]))
    before, after = aims[:turn], aims[turn:]
    assert np.abs(before[:, 1] - 0.5 * before[:, 0]).max() < 2e-6  # it began within a count of it
    way = np.array([0.030, 0.070]) - aims[turn]
    off = after - aims[turn]
    assert np.abs(off[:, 0] * way[1] - off[:, 1] * way[0]).max() / np.hypot(*way) < 1e-6


def test_a_replaced_programme_rests_on_its_path_and_a_stop_ends_both(
    bed: Bed, tmp_path: Path
) -> None:
    file = tmp_path / "slot.toml"
    file.write_text(CURVES, encoding="utf-8")
    plan = bed.settings.programmes.read(file, bed.settings.live.limits).plan
    bed.done(m.MovePoint({n: float(p.origin) for n, p in zip("xy", plan, strict=True)}))
    bed.ask(m.Programme(plan))
    bed.run(660)
    bed.aims = []
    number = bed.ask(m.MoveAxisBy("y", -0.005, "", True))
    bed.run(50)
    x, y = bed.aims[-1]
    assert abs(math.hypot(x - 0.080, y - 0.030) - 0.010) < 1e-9 and x > 0.085
    bed.run(60000, to_end=True)
    end = next(n for n in bed.notices[::-1] if isinstance(n, m.Finished))
    assert (Accepted(end.id), end.outcome) == (number, m.DONE)
    bed.ask(m.MovePoint({"x": 0.020, "y": 0.010}))
    bed.run(100)
    last = bed.ask(m.MovePointBy({"x": 0.001, "y": 0.001}, "", True))
    bed.run(3)
    bed.ask(m.Stop())
    bed.run(60000, to_end=True)
    end = next(n for n in bed.notices[::-1] if isinstance(n, m.Finished))
    assert (Accepted(end.id), end.outcome) == (last, m.STOPPED_BY_REQUEST)
    assert bed.mode == "stopped"


def test_moves_by_a_distance_count_from_the_targets(bed: Bed) -> None:
    bed.done(m.MovePoint({"x": 0.050, "y": 0.030}))
    assert bed.done(m.MovePointBy({"x": 0.010, "y": -0.005})).outcome == m.DONE
    assert bed.done(m.MoveAxisBy("y", 0.001)).outcome == m.DONE
    for _ in range(3):  # no error adds up
        bed.done(m.MoveAxisBy("x", 0.0012345))
    held, pitch = bed.aims[-1], bed.tree.x.encoder.pitch
    assert held == pytest.approx((0.060 + 3 * 0.0012345, 0.026), abs=1.5 * pitch)
    assert bed.place == pytest.approx(held, abs=4e-6)


def test_one_axis_moves_or_jogs_and_the_other_stands(bed: Bed) -> None:
    bed.done(m.MovePoint({"x": 0.050, "y": 0.030}))
    before = bed.place
    assert bed.done(m.MoveAxis("x", 0.060)).outcome == m.DONE
    assert bed.place[0] == pytest.approx(0.060, abs=3e-6)
    assert bed.place[1] == pytest.approx(before[1], abs=3e-6)
    first = bed.ask(m.Jog("y", 0.01))
    assert isinstance(first, Accepted)
    bed.run(200)
    assert isinstance(bed.ask(m.Jog("x", 0.01)), Refused)
    assert bed.ask(m.Jog("y", -0.005)) == first  # another speed, the same motion
    bed.run(300)
    assert bed.ask(m.Jog("y", 0.0)) == first
    bed.run(2000, to_end=True)
    assert bed.place[0] == pytest.approx(0.060, abs=3e-6) and bed.mode == "stopped"
    assert bed.done(m.MoveAxis("x", 0.050)).outcome == m.DONE and bed.mode == "ready"
    ends = {n.id: n.outcome for n in bed.notices if isinstance(n, m.Finished)}
    assert ends[first.id] == m.STOPPED_BY_REQUEST
    assert abs(bed.place[1] - before[1]) < 2e-3


CURVES = """title = "a slot"
[[paths]]
x = "40 mm"
y = "20 mm"
[[paths]]
x = "80 mm"
on = true
[[paths]]
centre = ["80 mm", "30 mm"]
angle = "180 deg"
on = true
[[paths]]
x = "40 mm"
hold = "0.1 s"
[[paths]]
points = [["20 mm", "40 mm"], ["20 mm", "10 mm"]]
rounding = "5 mm"
"""


def test_a_programme_of_paths_is_followed_in_step(bed: Bed, tmp_path: Path) -> None:
    file = tmp_path / "slot.toml"
    file.write_text(CURVES, encoding="utf-8")
    planned = bed.settings.programmes.read(file, bed.settings.live.limits)
    assert planned.title == "a slot" and planned.moves == 3
    bed.done(m.MovePoint({"x": 0.010, "y": 0.010}))
    bed.aims, bed.places = [], []
    end = bed.done(m.Programme(planned.plan))
    assert end.outcome == m.DONE and end.evidence["x_moves"] == 3
    assert bed.place == pytest.approx((0.020, 0.010), abs=3e-6)
    aims, places = np.array(bed.aims), np.array(bed.places)
    # The half circle of 10 mm around (80, 30).
    arc = aims[aims[:, 0] > 0.0801]
    radius = np.hypot(arc[:, 0] - 0.080, arc[:, 1] - 0.030)
    assert len(arc) > 50 and np.abs(radius - 0.010).max() < 1e-8
    assert np.abs(places - aims).max() < 20e-6
    # As a run makes it: the same set points.
    plan = planning.plan(course.load(file), bed.tree)
    first = plan.plans[0]
    assert aims[:, 0].max() == pytest.approx(first.pieces[:, 1].max(), abs=1e-6)


@pytest.mark.parametrize("periods", [480, 600, 660])
def test_a_stop_of_a_programme_stays_on_its_path(bed: Bed, tmp_path: Path, periods: int) -> None:
    """From a line on, from one into the arc, and within that; as fast as the axes can."""
    file = tmp_path / "slot.toml"
    file.write_text(CURVES, encoding="utf-8")
    plan = bed.settings.programmes.read(file, bed.settings.live.limits).plan
    bed.done(m.MovePoint({n: float(p.origin) for n, p in zip("xy", plan, strict=True)}))
    reply = bed.ask(m.Programme(plan))
    bed.run(periods)
    bed.aims = bed.aims[-2:]
    bed.ask(m.Stop())
    bed.run(3000, to_end=True)
    end = next(n for n in bed.notices[::-1] if isinstance(n, m.Finished))
    assert (end.id, end.outcome) == (reply.id, m.STOPPED_BY_REQUEST)  # type: ignore[union-attr]
    aims = np.array(bed.aims)
    x, y = aims.T
    line, arc = np.abs(y - 0.020), np.abs(np.hypot(x - 0.080, y - 0.030) - 0.010)
    off = np.where(x > 0.080, arc, line)
    speed = np.diff(aims, axis=0) / 1e-3
    along = np.hypot(*speed.T)
    rests = int(np.argmax(along == 0.0))
    assert off[:rests].max() < 1e-9
    assert off.max() < 2.0 * bed.settings.live.pitch  # then it is where the axes rest, to a count
    assert along[0] > 0.1 and np.diff(along[1 : rests + 1]).max() < 1e-5
    most = np.array([bed.tree.x.motion.acceleration, bed.tree.y.motion.acceleration])
    used = np.abs(np.diff(speed[1:], axis=0)).max(axis=0) / 1e-3 / most
    assert 0.95 < used.max() < 1.1  # as hard as one may, and a period of the jerk
    where = x[-1] > 0.080
    assert bool(where) == (periods > 500) and bed.pair.view().trusted == 1.0
    # What comes next begins there, and an axis alone brakes by itself again.
    assert bed.done(m.MoveAxis("x", 0.050)).outcome == m.DONE
    bed.ask(m.MoveAxis("x", 0.020))
    bed.run(60)
    bed.aims = []
    bed.ask(m.Stop())
    bed.run(3000, to_end=True)
    assert np.ptp([a[1] for a in bed.aims]) == 0.0 and bed.place[0] > 0.021


def test_a_stop_stays_on_its_path_where_the_encoders_count_from_elsewhere(tmp_path: Path) -> None:
    file = tmp_path / "slot.toml"
    file.write_text(CURVES, encoding="utf-8")
    bed = Bed()
    pitch, offsets = bed.settings.live.pitch, (500.0, -300.0)
    bed.pair.begin(bed.rig.read(), Restored(True, offsets[0], "known", offsets[1:]))
    bed.run(2)
    assert bed.ask(m.Enable()) == m.Accepted(0)
    bed.run(2)
    plan = bed.settings.programmes.read(file, bed.settings.live.limits).plan
    bed.done(m.MovePoint({n: float(p.origin) for n, p in zip("xy", plan, strict=True)}))
    reply = bed.ask(m.Programme(plan))
    bed.run(480)
    bed.aims = bed.aims[-1:]
    bed.ask(m.Stop())
    bed.run(3000, to_end=True)
    end = next(n for n in bed.notices[::-1] if isinstance(n, m.Finished))
    assert (end.id, end.outcome) == (reply.id, m.STOPPED_BY_REQUEST)  # type: ignore[union-attr]
    x, y = (np.array(bed.aims) - np.array(offsets) * pitch).T
    assert np.abs(y - 0.020).max() < 2.0 * pitch and np.ptp(x) > 0.002


def test_a_trajectory_is_run_by_its_times(bed: Bed, tmp_path: Path) -> None:
    file = tmp_path / "wave.csv"
    file.write_text("t_s,x_mm,y_mm\n0,20,20\n0.3,35,24\n0.6,42,40\n0.9,30,52\n1.2,20,50\n")
    plan = bed.settings.programmes.read(file, bed.settings.live.limits).plan
    assert bed.done(m.Programme(plan)).outcome == m.DONE
    assert bed.place == pytest.approx((0.020, 0.050), abs=3e-6)
    places = np.array(bed.places)
    assert np.hypot(places[:, 0] - 0.042, places[:, 1] - 0.040).min() < 60e-6


@pytest.mark.parametrize(
    ("request_", "words"),
    [
        (m.MoveTo(0.01), "two axes"),
        (m.MoveBy(0.01), "two axes"),
        (m.MoveMacro(10.0), "two axes"),
        (m.Jog("macro", 0.001), "two axes"),
        (m.SetLimits(None), "two axes"),
        (m.Fan(True), "two axes"),
        (m.MovePoint({"x": 0.01, "y": 0.5}), "y: position 500 mm"),
        (m.MovePoint({"x": 0.9, "y": 0.01}), "x: position 900 mm"),
        (m.MovePoint({"x": math.nan, "y": 0.0}), "x: "),
        (m.MovePoint({"x": 0.0, "y": "far"}), "y: "),  # type: ignore[dict-item]
        (m.MoveAxis("z", 0.01), "'z' is not an axis"),
        (m.MoveAxis("y", 0.9), "y: position 900 mm"),
        (m.MoveAxisBy("z", 0.01), "'z' is not an axis"),
        (m.MoveAxisBy("x", math.inf), "x: distance"),
        (m.MovePointBy({"x": 0.0, "y": 0.9}), "y: position 9"),
        (m.Jog("y", 5.0), "y: speed 5"),
        (m.Programme(None), "no programme"),
        (m.Programme((None, None)), "no programme"),
        (m.SetGains((("position", 1.0),)), "not a gain"),
        (m.SetGains((("x.position", -1.0),)), "x: "),
        (m.SetGains((("z.position", 1.0),)), "not a gain"),
        (m.SetGains("x"), "not a gain"),  # type: ignore[arg-type]
        (m.ClearFault(gone=True), "x: there is no fault"),
        (m.Enable(), "x: the positioner is enabled"),
        ("nonsense", "not a request"),
    ],
)
def test_what_cannot_be_is_refused_and_changes_nothing(
    bed: Bed, request_: object, words: str
) -> None:
    reply = bed.ask(request_)
    assert isinstance(reply, Refused) and words in reply.reason, reply
    assert bed.pair.refusal(request_) == reply
    assert bed.pair.view().motion == 0 and bed.notices == []


SAMPLES = (
    m.Enable(), m.Disable(), m.Home(), m.Zero(), m.Stop(), m.EmergencyStop(), m.Fan(True),
    m.MoveTo(0.02), m.MoveBy(0.02), m.MoveMacro(200), m.MoveMicro(1e-3),
    m.MovePoint({"x": 0.03, "y": 0.02}), m.MovePointBy({"x": 1e-3, "y": 1e-3}),
    m.MoveAxis("x", 0.03), m.MoveAxisBy("y", 1e-3),
    m.ClearFault(True), m.SetLimits(None), m.Jog("y", 0.001),
)  # fmt: skip


def test_offered_is_what_is_not_refused_for_the_mode() -> None:
    bed = Bed(known=False)
    seen = []

    def look() -> None:
        view = bed.pair.view()
        offered = possible(
            int(view.mode), moving=view.motion != 0, trusted=view.trusted == 1.0, stages=m.AXES
        )
        for request in SAMPLES:
            refused = bed.pair.refusal(request)
            assert (refused is None) == (type(request) in offered), (bed.mode, request, refused)
        seen.append((bed.mode, view.trusted))

    look()
    bed.ask(m.Disable())
    look()
    bed.ask(m.Enable())
    bed.run(1)
    bed.ask(m.Home())
    look()
    bed.run(60000, to_end=True)
    look()
    bed.ask(m.MovePoint({"x": 0.1, "y": 0.05}))
    bed.run(50)
    look()
    bed.pair.fail("blocked", {}, False)
    look()
    assert [mode for mode, _ in seen] == [
        "ready", "disabled", "homing", "ready", "moving-macro", "fault",
    ]  # fmt: skip


def test_gains_of_both_change_at_once_or_not_at_all(bed: Bed) -> None:
    was = bed.settings.controller
    both = (("x.position", 0.5 * was.x.position), ("y.position", 0.25 * was.y.position))
    reply = bed.ask(m.SetGains(both))
    assert isinstance(reply, Accepted)
    assert [(c.path, c.new) for c in reply.changes] == list(both)
    assert bed.rig.control._gains[1].position == 0.25 * was.y.position
    told = [n for n in bed.notices if isinstance(n, Event) and n.kind == "gains"]
    assert {k for n in told for k in n.evidence} == {"x.position", "y.position"}
    wrong = bed.ask(m.SetGains((("x.position", was.x.position), ("y.position", -1.0))))
    assert isinstance(wrong, Refused) and bed.rig.control._gains[0].position == both[0][1]
    back = (("x.position", was.x.position), ("y.position", was.y.position))
    assert isinstance(bed.ask(m.SetGains(back)), Accepted)


def test_a_fault_of_one_axis_switches_both_off_in_the_same_period() -> None:
    bed = Bed()
    bed.ask(m.MovePoint({"x": 0.100, "y": 0.050}))
    bed.run(150)
    control = bed.rig.control
    assert all(abs(effort) > 0.0 for effort in control.efforts)
    # Somebody blocks y: it is put back where it began.
    kind = control.kinds[1]
    bed.rig._states = (bed.rig._states[0], kind.initial(bed.rig._bench.stages[1]))
    bed.run(1)
    assert control.tripped and control.efforts == [0.0, 0.0] and control.enable == 0.0
    assert control.watches[0].fault == OTHER_AXIS
    assert control.watches[1].fault not in (OK, OTHER_AXIS)
    assert control.watches[0].time == control.watches[1].time
    assert control.faulty == 1
    code = faults.AXIS + 100 + control.watches[1].fault
    found = faults.describe(code, *control.watches[1][1:4], axes=bed.settings.axes)
    assert found.name.startswith("y: ") and found.message.startswith("Axis y: ")
    assert "both axes" in found.evidence
    bed.notices += bed.pair.fail(found.name, {"evidence": found.evidence}, False)
    ends = [n for n in bed.notices if isinstance(n, m.Finished)]
    assert [end.outcome for end in ends] == [m.FAULTED] and bed.mode == "fault"
    bed.run(20)
    assert control.efforts == [0.0, 0.0]
    control.renew()
    assert bed.ask(m.ClearFault(gone=True)) == Accepted() and bed.mode == "disabled"


def test_an_emergency_stop_switches_both_off_at_once() -> None:
    bed = Bed()
    bed.ask(m.MovePoint({"x": 0.100, "y": 0.050}))
    bed.run(100)
    bed.ask(m.EmergencyStop())
    bed.run(1)
    assert bed.rig.control.efforts == [0.0, 0.0] and bed.mode == "disabled"
    assert bed.pair.view().trusted == 0.0
    ends = [n for n in bed.notices if isinstance(n, m.Finished)]
    assert [end.outcome for end in ends] == [m.EMERGENCY]


def test_an_axis_that_does_not_arrive_ends_the_motion_of_both(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    text = PLOTTER.read_text(encoding="utf-8").replace("0.25 ms", "1 ms")
    file.write_text(text + '\n[y.arrival]\npatience = "50 ms"\ndwell = "1 s"\n', encoding="utf-8")
    bed = Bed(file)
    end = bed.done(m.MovePoint({"x": 0.030, "y": 0.020}))
    assert end.outcome == m.STALLED and bed.mode == "stopped"
    assert "y_error_um" in end.evidence or "y_way_counts" in end.evidence


@pytest.mark.slow
def test_axes_home_on_their_own_switches(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    switch = '\n[x.switches]\nhome = "cam"\n[x.homing]\non = "home"\n'
    file.write_text(PLOTTER.read_text(encoding="utf-8") + switch, encoding="utf-8")
    bed = Bed(file, known=False)
    assert bed.done(m.Home()).outcome == m.DONE
    words = [n.cause for n in bed.notices if isinstance(n, Event) and n.kind == "move"]
    assert any("switch" in w for w in words) and any("stop" in w for w in words), words
    assert bed.done(m.MovePoint({"x": 0.05, "y": 0.03})).outcome == m.DONE


@pytest.mark.parametrize(("period", "looks"), [("2 ms", 2e-3), ("0.4 ms", 1.2e-3)])
def test_another_period_is_that_of_both(period: str, looks: float, tmp_path: Path) -> None:
    text = re.sub(r"(timing\]\nperiod = ).*", rf'\1"{period}"', PLOTTER.read_text("utf-8"))
    file = tmp_path / "slow.toml"
    file.write_text(text, encoding="utf-8")
    bed = Bed(file)
    assert bed.settings.period == pytest.approx(looks)
    bed.done(m.MovePoint({"x": 0.020, "y": 0.010}))
    bed.aims = []
    end = bed.done(m.MovePoint({"x": 0.100, "y": 0.050}))
    assert end.outcome == m.DONE
    assert bed.place == pytest.approx((0.100, 0.050), abs=2e-5)
    aims = np.array(bed.aims)
    assert np.abs(aims[:, 1] - 0.5 * aims[:, 0]).max() < 2e-5
    speed = np.diff(aims, axis=0) / looks
    assert np.hypot(*speed.T).max() <= 1.001 * bed.tree.path.speed
