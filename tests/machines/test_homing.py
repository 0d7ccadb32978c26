"""How an axis feels for its end stop: no more than its guard and its stops bear, and enough."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from macromicro.control.live.leading import Touch
from macromicro.machines import homing, machine, sheets

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "machines").glob("[!x]*.toml"))
AXES = [p for p in EXAMPLES if machine.load(p)[0].touch is not None]


def test_only_an_axis_has_to_look_for_its_place() -> None:
    names = ["coil", "disc", "emps", "micro", "printer", "screw", "servo", "stage"]
    assert [p.stem for p in AXES] == names


@pytest.mark.parametrize("path", AXES, ids=lambda p: p.stem)
def test_it_starts_the_axis_and_trips_no_guard(path: Path) -> None:
    chosen, tree = machine.load(path)
    assert chosen.touch is not None
    found = chosen.touch(tree)
    per_newton = sheets.per_newton(tree)
    assert per_newton * sheets.breakaway_force(tree) < found.effort < tree.guard.push
    assert found.lead <= 0.5 * tree.guard.error
    assert 0.0 < found.slow <= found.speed < 0.2 * tree.motion.velocity
    # The slow touch goes farther within a stand than what counts as none.
    assert found.slow * found.stand > found.give or found.slow == found.speed
    assert found.back > found.give
    # The law gives the whole effort while it leans, by its integral at the latest.
    law = tree.controller
    gathered = law.velocity * (law.position * found.lead) * (1.0 + law.integral * found.stand)
    assert gathered > 2.0 * found.effort
    # Friction, back-EMF and all: it keeps its speed on the way down, against a weight or with it.
    slides = per_newton * (tree.friction.coulomb + tree.friction.ripple)
    assert slides + law.ahead_velocity * found.speed <= found.effort
    # What runs into the stop pushes it no harder than the motor can.
    mass, stiffness = sheets.mass(tree), tree.load.stop_stiffness
    assert found.speed * (mass * stiffness) ** 0.5 <= sheets.force(tree) * (1.0 + 1e-9)
    assert found.place <= tree.load.stop_low < tree.guard.low < tree.travel.low
    assert found.patience > (tree.load.stop_high - tree.load.stop_low) / found.speed


def test_the_stop_has_given_way_to_what_friction_leaves_of_the_push() -> None:
    tree = machine.load(AXES[0])[1]
    push = 0.9 * tree.guard.push / sheets.per_newton(tree)
    gives = (push - tree.friction.coulomb) / tree.load.stop_stiffness
    assert homing.touch(tree).place == pytest.approx(tree.load.stop_low - gives, rel=1e-9)


def changed(tree: Any, values: dict[str, float | str]) -> Any:
    """The settings with these, named as in a file."""
    for name, value in values.items():
        room, _, key = name.partition(".")
        tree = tree._replace(**{room: getattr(tree, room)._replace(**{key: value})})
    return tree


# 20 N at 10 N/A, 0.5 V/N, 4 kg: what runs into the stop at v pushes it with 2000 v.
ROUND: dict[str, float | str] = {
    "amplifier.mode": "current",
    "amplifier.supply": 24.0,
    "amplifier.current": 9.0,
    "amplifier.full_scale": 10.0,
    "amplifier.transconductance": 0.2,
    "motor.resistance": 2.0,
    "motor.force": 10.0,
    "drive.kind": "linear",
    "drive.efficiency": 1.0,
    "load.mass": 3.0,
    "load.payload": 1.0,
    "load.incline": 0.0,
    "load.stop_low": -0.1,
    "load.stop_high": 0.3,
    "load.stop_stiffness": 1e6,
    "friction.coulomb": 3.0,
    "encoder.pitch": 1e-5,
    "motion.velocity": 0.5,
    "arrival.tolerance": 3e-5,
    "controller.position": 30.0,
    "controller.velocity": 20.0,
    "controller.integral": 2.0,
    "controller.ahead_velocity": 50.0,
    "guard.push": 5.0,  # 4.5 V push with 9 N, of which friction leaves 6 N
    "guard.error": 0.02,
}
FOUND = Touch(
    speed=0.01,  # the stop's
    slow=0.005,
    effort=4.5,
    lead=0.01,
    stand=0.75,
    give=4e-5,
    back=0.004,
    place=-0.1 - 6e-6,
    patience=5.0 * (40.0 + 0.8) + 10.0,
)


@pytest.mark.parametrize(
    ("values", "found"),
    [
        ({}, {}),
        (
            {"controller.ahead_velocity": 1000.0},  # the back-EMF's speed
            {"speed": 1.575e-3, "slow": 1.575e-3, "patience": 5.0 * 0.404 / 1.575e-3 + 10.0},
        ),
        (
            {"motion.velocity": 0.05, "arrival.tolerance": 1e-6},
            {"speed": 0.005, "slow": 0.0005, "patience": 5.0 * (80.0 + 8.0) + 10.0},
        ),
        (
            {"load.stop_stiffness": 1e3},  # gives way by 6 mm
            {
                "speed": 0.0315,
                "back": 0.01216,
                "place": -0.106,
                "patience": 5.0 * (0.4 / 0.0315 + 2.432) + 10.0,
            },
        ),
        ({"guard.error": 1.0}, {"lead": 0.015, "stand": 0.5}),
        ({"controller.integral": 20.0}, {"stand": 0.3}),
        (
            {"arrival.tolerance": 1.2e-3},
            {"give": 1.2e-3, "slow": 0.008, "back": 4.812e-3, "patience": 213.0075},
        ),
        # 4 kg hang on it, or pull it up.
        ({"load.incline": 0.5 * math.pi}, {"place": -0.1 - 45.2266e-6}),
        ({"load.incline": -0.5 * math.pi}, {"place": -0.1}),
    ],
)
def test_each_of_its_numbers_worked_out_by_hand(
    values: dict[str, float | str], found: dict[str, float]
) -> None:
    tree = changed(machine.load(AXES[0])[1], {**ROUND, **values})
    expected = FOUND._replace(**found)
    touch = homing.touch(tree)
    numbers = Touch._fields.index("seek")
    assert touch[:numbers] == pytest.approx(expected[:numbers], rel=1e-9, abs=1e-12)
    assert touch.seek is None  # the stop, not a switch
    assert math.isnan(touch.out)  # and then to the lowest target


# 0.5 V/N, 3 N of friction, 4 kg; 1 ms, 1 ms and 2 ms late.
SHOWS: dict[str, float | str] = {
    **ROUND,
    "timing.period": 1e-3,
    "timing.delay": 1e-3,
    "amplifier.bandwidth": 250.0 / math.pi,
    "friction.stribeck": 0.0,
    "friction.ripple": 0.0,
    "guard.still": 0.01,
}


@pytest.mark.parametrize(
    ("lean", "still", "reveal"),
    [
        (2.5, 0.01, 4.0 * (0.2 + 4e-3)),  # 2 N are left
        (1.75, 0.01, 4.0 * (0.4 + 4e-3)),  # 0.5 N
        (1.5, 0.01, 4.0 * (homing.STAND + 4e-3)),  # none
        (2.5, 1e-9, homing.REVEAL),
    ],
)
def test_in_time_a_free_stage_shows_that_it_moves(lean: float, still: float, reveal: float) -> None:
    own = {**SHOWS, "guard.lean": lean, "guard.still": still}
    tree = changed(machine.load(AXES[0])[1], own)
    assert homing.reveal(tree) == pytest.approx(reveal, rel=1e-9)
    touch = homing.touch(tree)
    assert touch is not None and touch.reveal == homing.reveal(tree)


def test_an_axis_without_ends_is_searched_for_a_turn_and_a_half() -> None:
    chosen, tree = machine.load(next(p for p in AXES if p.stem == "disc"))
    endless = tree.with_({"load.ends": "none", "encoder.index_pulse": "mark", "homing.on": "index"})
    touch = chosen.touch and chosen.touch(endless)
    assert touch is not None and touch.seek is not None
    took = 2.0 * 3.0 * math.pi / touch.speed + touch.back / touch.slow
    assert touch.patience == pytest.approx(5.0 * (took + 3.0 * math.pi / touch.seek.rise) + 10.0)
