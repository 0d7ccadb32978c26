"""The live machine of two axes and a piezo, and of stages that move in turn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.serve.group.bed import Bed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Event, Refused
from macromicro.errors import ProblemError
from macromicro.serve import settings

XYZ = Path(__file__).parents[3] / "examples" / "machines" / "xyz.toml"
TOGETHER = 'machine = {{ stages = {{ {stages} }}, order = "{order}" }}\n'


def written(folder: Path, stages: str, order: str = "together") -> Path:
    file = folder / "own.toml"
    file.write_text(TOGETHER.format(stages=stages, order=order), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def homed() -> Bed:
    bed = Bed(XYZ, known=False)
    assert bed.done(m.Home()).outcome == m.DONE
    return bed


@pytest.fixture
def bed(homed: Bed) -> Bed:
    homed.notices, homed.places, homed.aims = [], [], []
    return homed


@pytest.mark.slow
def test_the_axes_home_and_the_piezo_needs_none(bed: Bed) -> None:
    assert bed.pair.view().trusted == 1.0 and len(bed.pair.readings()) == 2
    assert bed.settings.homing == (0, 1)
    assert [led.searches for led in bed.pair._leds] == [True, True, False]


@pytest.mark.slow
def test_a_move_to_a_point_is_straight_in_all_stages_and_so_is_its_stop(bed: Bed) -> None:
    begin, goal = np.array([0.02, 0.01, 10e-6]), np.array([0.12, 0.06, 80e-6])
    names = ("x", "y", "z")
    assert bed.done(m.MovePoint(dict(zip(names, begin, strict=True)))).outcome == m.DONE
    bed.aims = []
    assert isinstance(bed.ask(m.MovePoint(dict(zip(names, goal, strict=True)))), Accepted)
    bed.run(150)
    bed.ask(m.Stop())
    bed.run(3000, to_end=True)
    assert bed.mode == "stopped"
    shares = (np.array(bed.aims) - begin) / (goal - begin)
    assert shares[-1].min() > 0.05 and shares[-1].max() < 0.95
    pitches = np.array([live.pitch for live in bed.settings.lives])
    assert np.all(np.ptp(shares, axis=1) < 2.0 * np.sum(pitches / (goal - begin)))


@pytest.mark.slow
def test_some_stages_move_and_the_others_stand(bed: Bed) -> None:
    bed.done(m.MovePoint({"x": 0.03, "y": 0.03, "z": 20e-6}))
    before = bed.place
    assert bed.done(m.MovePoint({"z": 50e-6, "x": 0.05})).outcome == m.DONE
    assert bed.place == pytest.approx((0.05, before[1], 50e-6), abs=3e-5)
    assert bed.done(m.MovePointBy({"z": -20e-6})).outcome == m.DONE
    assert bed.done(m.MoveAxisBy("y", 0.01)).outcome == m.DONE
    assert bed.place[2] == pytest.approx(30e-6, abs=1e-7)
    bed.ask(m.Jog("z", 10e-6))
    bed.run(500)
    bed.ask(m.Jog("z", 0.0))
    bed.run(2000, to_end=True)
    assert 33e-6 < bed.place[2] < 37e-6


@pytest.mark.slow
def test_unknown_names_are_refused_with_those_of_the_machine(bed: Bed) -> None:
    for request in (m.MovePoint({"w": 0.0}), m.MoveAxis("w", 0.0), m.Jog("w", 0.1)):
        refused = bed.ask(request)
        assert isinstance(refused, Refused) and refused.remedy == 'name "x", "y" or "z"'
    for request in (m.MovePoint({}), m.MovePoint([0.1, 0.1, 0.1])):  # type: ignore[arg-type]
        assert isinstance(bed.ask(request), Refused)
    refused = bed.ask(m.SetGains((("w.integral", 1.0),)))
    assert isinstance(refused, Refused) and "x.position" in refused.remedy
    refused = bed.ask(m.MovePoint({"x": 0.05, "z": 1e-3}))
    assert isinstance(refused, Refused) and refused.reason.startswith("z: position 1 mm")


@pytest.mark.slow
def test_its_programme_moves_all_stages_at_once(bed: Bed) -> None:
    plan = bed.settings.programmes.named("usual", bed.settings.live.limits).plan
    assert bed.done(m.Programme(plan)).outcome == m.DONE
    aims = np.array(bed.aims)
    for k, live in enumerate(bed.settings.lives):
        assert aims[:, k].max() == pytest.approx(0.9 * live.limits.whole_high, rel=1e-3)


@pytest.mark.slow
def test_its_gains_are_those_of_each_stage(bed: Bed) -> None:
    reply = bed.ask(m.SetGains((("z.integral", 0.5 * bed.tree.z.controller.integral),)))
    assert isinstance(reply, Accepted) and reply.changes[0].path == "z.integral"
    text = bed.settings.as_toml(bed.settings.controller, bed.settings.live.limits)
    assert 'z = "piezo"' in text


@pytest.mark.slow
def test_an_axis_with_a_piezo_on_it_is_one_machine(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, 'z = "piezo", slide = "axis"'))
    assert bed.settings.homing == (1,) and len(bed.pair.readings()) == 1
    assert bed.done(m.MovePoint({"slide": 0.05, "z": 40e-6})).outcome == m.DONE
    assert bed.place == pytest.approx((40e-6, 0.05), abs=3e-5)


@pytest.mark.slow
def test_stages_in_turn_move_one_after_the_other(tmp_path: Path) -> None:
    bed = Bed(written(tmp_path, 'z = "piezo", slide = "axis"', "in turn"))
    assert bed.done(m.MovePoint({"slide": 0.05, "z": 40e-6})).outcome == m.DONE
    aims = np.array(bed.aims)
    last, first = np.flatnonzero(np.diff(aims[:, 0]))[-1], np.flatnonzero(np.diff(aims[:, 1]))[0]
    assert last < first and bed.place == pytest.approx((40e-6, 0.05), abs=3e-5)
    bed.ask(m.MovePoint({"slide": 0.02, "z": 10e-6}))
    bed.run(2)
    bed.ask(m.Stop())
    bed.run(3000, to_end=True)
    ends = [n for n in bed.notices if isinstance(n, m.Finished)]
    assert ends[-1].outcome == m.STOPPED_BY_REQUEST
    assert bed.place[1] == pytest.approx(0.05, abs=3e-5)
    modes = [n.to_mode for n in bed.notices if isinstance(n, Event) and n.kind == "mode"]
    assert modes[-1] == "stopped"


@pytest.mark.parametrize("stages", ['macro = "axis", z = "piezo"', 'x1 = "axis", x2 = "axis"'])
def test_names_that_protocols_cannot_use_are_refused(tmp_path: Path, stages: str) -> None:
    with pytest.raises(ProblemError, match="another name"):
        settings.load(written(tmp_path, stages))


def test_stages_of_different_units_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ProblemError, match="Serve one stage"):
        settings.load(written(tmp_path, 'x = "axis", r = "rotary"'))
