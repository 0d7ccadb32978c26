"""An axis that turns is commissioned as one that slides, in angles."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from macromicro.commission import axis, kinds, places, report, rotary
from macromicro.commission._axis_page import rows
from macromicro.commission._gravity import Weight
from macromicro.commission._probing import Direction, Ends
from macromicro.commission.procedure import Options, Work
from macromicro.commission.running import commission
from macromicro.commission.stand import Stand
from macromicro.errors import InputError
from macromicro.identify import axis_settings
from macromicro.identify.axis_settings import Around
from macromicro.machines import machine as machines
from macromicro.machines import sheets
from macromicro.models.mass import Axis
from macromicro.place import ANGLE, LENGTH
from macromicro.schema import config
from macromicro.schema.text import parsed_toml

DISC = Path(__file__).parents[2] / "examples" / "machines" / "disc.toml"
DEG = math.pi / 180.0


def test_it_is_a_kind_whose_efforts_go_both_ways() -> None:
    assert kinds.by_name("rotary") is rotary.KIND and rotary.KIND.place is ANGLE
    place = places.virtual(DISC)
    assert place.kind is rotary.KIND and place.lowest is None and place.effort == 10.0
    assert place.pitch == pytest.approx(2.0 * math.pi / 2048)


def work(place: Any) -> Work:
    stand = Stand(cast("Any", None), 1e-3, 1e-4, place=place)
    made = Work(stand, Options(5.0, 10.0, 0.5, 2.0))
    made.found |= {
        axis.DIRECTION: Direction(1.0, 0.2, 0.3, 0.0, 1.0),
        axis.ENDS: Ends(-0.1, 1.4, True),
        axis.WEIGHT: Weight(0.0, 0.0),
    }
    return made


def test_what_it_will_do_is_said_in_degrees() -> None:
    def intents(place: Any) -> str:
        made = work(place)
        steps = (s for s in rotary.KIND.steps if s.name != axis.DIRECTION)
        return " ".join(step.intent(made) for step in steps)

    said = intents(ANGLE)
    assert "28.6 deg/s" in said and "114.6 deg each way" in said
    assert "-5.73 and 80.21 deg" in said and "573 deg/s" in said and "mm" not in said
    assert "500 mm/s" in intents(LENGTH) and "deg" not in intents(LENGTH)
    assert ("travel", "85.944", "", "deg") in rows(work(ANGLE))
    assert "to [deg]" in report.headings(ANGLE) and "overshoot [mdeg]" in report.headings(ANGLE)
    assert "to [mm]" in report.headings(LENGTH)


def test_the_machine_that_follows_turns_and_has_the_same_equations() -> None:
    found = Axis(0.02, 0.6, 0.15, 0.0, 0.0, 0.03, 0.02, 2e-4)
    around = Around(1.0, 8.0, 1e-4, 1e-3, 5.0, 20.0, 0.01)
    slides = axis_settings.values(found, around)
    text = axis_settings.as_toml(axis_settings.as_rotary(slides), "Found.", "rotary")
    table = parsed_toml(text, "text")
    table.pop(config.MACHINE)
    tree = config.overridden(machines.named("rotary", "").settings, table, "text")  # type: ignore[union-attr]
    other = parsed_toml(axis_settings.as_toml(slides, "Found."), "text")
    other.pop(config.MACHINE)
    plain = config.overridden(machines.named("axis", "").settings, other, "text")  # type: ignore[union-attr]
    for value in (sheets.mass, sheets.constant, sheets.force, sheets.per_newton, sheets.lag):
        assert value(tree) == pytest.approx(value(plain), rel=1e-12)
    frequency = np.array([1.0, 10.0, 80.0])
    assert sheets.plant(tree, frequency) == pytest.approx(sheets.plant(plain, frequency))
    assert tree.friction.coulomb == plain.friction.coulomb
    assert tree.travel.high == plain.travel.high and tree.load.inertia == plain.load.mass


def test_one_that_turns_on_has_a_window_and_no_stops(tmp_path: Path) -> None:
    file = tmp_path / "on.toml"
    file.write_text(DISC.read_text().replace("[load]\n", '[load]\nends = "none"\n'))
    assert places.virtual(file).endless and not places.virtual(DISC).endless
    made = work(ANGLE)
    made.options = Options(5.0, 10.0, 0.5, 2.0, -3.0, 3.0, endless=True).checked()
    made.found[axis.ENDS] = Ends(-3.0, 3.0, False)
    said = {step.name: step.intent(made) for step in rotary.KIND.steps}[axis.ENDS]
    assert said.startswith("Continuous rotation: a window is used, -171.9 to 171.9 deg")
    with pytest.raises(InputError, match=r"needs a window\. Add --from and --to"):
        Options(5.0, 10.0, 0.5, 2.0, endless=True).checked()
    found = Axis(0.02, 0.6, 0.15, 0.0, 0.0, 0.03, 0.02, 2e-4)
    slides = axis_settings.values(found, Around(1.0, 8.0, 1e-4, 1e-3, 6.0, 20.0, 0.01))
    text = axis_settings.as_toml(
        axis_settings.endless(axis_settings.as_rotary(slides)), "Found.", "rotary"
    )
    table = parsed_toml(text, "text")
    table.pop(config.MACHINE)
    tree = config.overridden(machines.named("rotary", "").settings, table, "text")  # type: ignore[union-attr]
    assert tree.load.ends == "none" and "stop" not in text
    assert (tree.travel.low, tree.travel.high) == (0.0, 6.0)
    assert tree.guard.high == pytest.approx(6.0 + math.pi)


@pytest.mark.slow
def test_one_that_turns_on_is_commissioned(tmp_path: Path) -> None:
    file = tmp_path / "on.toml"
    file.write_text(
        DISC.read_text().replace(
            "[load]\n", '[load]\nends = "none"\nunbalance = "1.5 mN*m"\nhangs = "70 deg"\n'
        )
    )
    place = places.virtual(file)
    found = commission(
        place,
        Options(place.effort, 4.0 * math.pi, 0.5, 400 * DEG, -math.pi, math.pi, endless=True),
    )
    told = rotary.estimates(found.model)
    true = machines.load(file)[1].load.unbalance * sheets.per_newton(machines.load(file)[1])
    assert abs(told["unbalance"].value - true) < 2.0 * told["unbalance"].half
    assert found.verified.met and found.settings.load.ends == "none"
    assert not any("end stop" in one for one in rotary.doubts(found.work, found.model))


@pytest.mark.slow
def test_a_disc_is_found_and_verified() -> None:
    place = places.virtual(DISC)
    found = commission(place, Options(place.effort, 4.0 * math.pi, 0.5, 400 * DEG))
    same = machines.load(DISC)[1]
    truth = {"mass": sheets.mass(same), "coulomb": same.friction.coulomb}
    told = rotary.estimates(found.model)
    for name, value in truth.items():
        one = told[name]
        assert abs(one.value - value * sheets.per_newton(same)) < 2.0 * one.half
    assert told["mass"].unit == "V*s^2/rad" and told["viscous"].unit == "V*s/rad"
    assert found.verified.met
    assert found.settings.travel.high == pytest.approx(same.travel.high, abs=20 * DEG)
