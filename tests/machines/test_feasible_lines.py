"""Switches, pulses and drive lines that cannot work are refused before a run, with numbers."""

from __future__ import annotations

import pytest

from macromicro.errors import InputError
from macromicro.machines import _wiring, homing
from macromicro.machines.axis import DEFAULT

LIMITS = {"switches.limits": "both"}
HOME = {"switches.home": "below"}
CAM = {"switches.home": "cam"}
TURN = {"encoder.index_pulse": "turn"}
MARK = {"encoder.index_pulse": "mark"}
FAULT = {"amplifier.fault": "line"}
LINEAR = {"drive.kind": "linear", "motor.force": "10 N/A", "encoder.pitch": "5 um"}

CASES = [
    # Travel from 0 to 298.8 mm, stops at -5 and 305 mm; a switch needs 70 um to let go.
    ({**LIMITS, "switches.low": "-5.1 mm"}, "switches.low", "load.stop_low (-5 mm)"),
    ({**LIMITS, "switches.low": "-0.06 mm"}, "switches.low", "at most -0.07 mm"),
    ({**LIMITS, "switches.low": "3 mm"}, "switches.low", "travel.low (0 mm)"),
    ({**LIMITS, "switches.high": "305.1 mm"}, "switches.high", "load.stop_high (305 mm)"),
    ({**LIMITS, "switches.high": "298.86 mm"}, "switches.high", "298.87 mm or more"),
    ({**HOME, "switches.home_place": "-6 mm"}, "switches.home_place", "above -4.93 mm"),
    ({**HOME, **LIMITS, "switches.home_place": "-4 mm"}, "switches.home_place", "above -3.68 mm"),
    ({**HOME, "switches.home_place": "306 mm"}, "switches.home_place", "and below 304.3"),
    (
        {**CAM, "switches.home_place": "0 mm", "switches.home_width": "8 mm"},
        "switches.home_place",
        "above 3.07 mm",
    ),
    ({**CAM, "switches.home_width": "0.2 mm"}, "switches.home_width", "0.2654 mm or more"),
    ({**TURN, **LINEAR}, "encoder.index_pulse", "mark"),
    ({**TURN, "encoder.at": "load"}, "encoder.index_pulse", "mark"),
    ({**MARK, "encoder.index_place": "-5 mm"}, "encoder.index_place", "load.stop_low (-5 mm)"),
    ({**MARK, "encoder.index_place": "305 mm"}, "encoder.index_place", "load.stop_high (305"),
    ({"homing.on": "limit"}, "homing.on", 'switches.limits = "low" or "both"'),
    ({"homing.on": "limit", "switches.limits": "high"}, "homing.on", "switches.limits"),
    ({"homing.on": "home"}, "homing.on", 'switches.home = "below" or "cam"'),
    ({**HOME, "homing.on": "home+index"}, "homing.on", 'encoder.index_pulse = "turn" or "mark"'),
    ({**TURN, "homing.on": "home+index"}, "homing.on", "switches.home"),
    ({**TURN, "homing.on": "index"}, "homing.on", "which of them it is tells a switch"),
    (
        {**MARK, **HOME, "homing.on": "home+index", "encoder.index_place": "14.98 mm"},
        "encoder.index_place",
        "takes the pulse above the switch",
    ),
    (
        {**TURN, **HOME, "homing.on": "home+index", "encoder.index_place": "14.98 mm"},
        "encoder.index_place",
        "the nearest is 0.04 mm from it: move the switch",
    ),
    (
        {**TURN, **HOME, "homing.on": "home+index", "encoder.index_place": "14.90 mm"},
        "encoder.index_place",
        "the nearest is 0.04 mm from it: move the switch",
    ),
    (
        {**TURN, **HOME, "homing.on": "home+index", "switches.repeatability": "4 mm"},
        "encoder.index_pulse",
        "a turn is 50.27 mm",
    ),
    ({**FAULT, "amplifier.continuous": "4 A"}, "amplifier.continuous", "amplifier.current (4 A)"),
    ({**FAULT, "amplifier.continuous": "0.9 A"}, "amplifier.continuous", "above 0.9536 A"),
]


@pytest.mark.parametrize(("changes", "path", "words"), CASES)
def test_it_is_refused(changes: dict[str, str], path: str, words: str) -> None:
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert error.value.where.endswith(path), error.value
    assert words in error.value.accepted


@pytest.mark.parametrize("on", ["limit", "home", "limit+index", "home+index"])
@pytest.mark.parametrize("home", [HOME, CAM])
@pytest.mark.parametrize("pulse", [TURN, MARK])
def test_what_follows_from_the_defaults_is_possible(
    on: str, home: dict[str, str], pulse: dict[str, str]
) -> None:
    tree = DEFAULT.with_({**LIMITS, **home, **pulse, **FAULT, "homing.on": on})
    load, switches = tree.load, tree.switches
    assert load.stop_low < switches.low < tree.guard.low < tree.travel.low
    assert tree.travel.high < tree.guard.high < switches.high < load.stop_high
    touch = homing.touch(tree)
    assert touch.seek is not None and touch.seek.pulse == ("index" in on)
    edge = switches.low if on.startswith("limit") else switches.home_place
    assert homing.edge(tree) == edge
    assert touch.seek.line == ("limit_low" if on.startswith("limit") else "home")
    assert touch.seek.above == (home is CAM and on.startswith("home"))
    assert 0.0 < touch.slow <= touch.seek.rise <= touch.speed
    # Within a period it goes no farther than the switch scatters, or a count.
    assert touch.slow * 1e-3 <= max(switches.repeatability, tree.encoder.pitch) * (1.0 + 1e-9)
    # It can turn within half the way from the limit switch to the stop.
    if on.startswith("limit"):
        braked = touch.speed**2 / (2.0 * tree.motion.acceleration)
        assert braked <= 0.5 * (switches.low - load.stop_low) * (1.0 + 1e-9)
    if "index" not in on:
        assert touch.place == edge
        return
    spacing = _wiring.spacing(tree)
    assert touch.place > edge + touch.seek.margin
    if pulse is TURN:
        assert spacing == pytest.approx(2.0 * 3.141592653589793 * 8e-3)
        assert touch.place == pytest.approx(edge + 0.5 * spacing, abs=1e-8)
    else:
        assert spacing == 0.0 and touch.place == tree.encoder.index_place


def test_the_pulse_above_the_edge_whichever_pulse_is_given() -> None:
    changes = {**TURN, **HOME, "homing.on": "home+index"}
    spacing = _wiring.spacing(DEFAULT.with_(changes))
    for turns in (-0.0, 1.0, 3.0):
        place = 20e-3 + turns * spacing
        tree = DEFAULT.with_({**changes, "encoder.index_place": f"{place * 1e3!r} mm"})
        assert homing.pulse(tree) == pytest.approx(20e-3, abs=1e-12)
    margin = 4.0 * 5e-6 + homing.slow(tree) * 1e-3 + 2.0 * tree.encoder.pitch
    assert homing.margin(tree) == pytest.approx(margin)
    rise = min(homing.speed(tree), 10.0 * homing.slow(tree))
    back = 4.0 * 5e-6 + rise**2 / tree.motion.acceleration + 4.0 * tree.encoder.pitch
    assert homing.back(tree) == pytest.approx(back)


def test_the_numbers_of_a_search_worked_out_by_hand() -> None:
    fine = {**LIMITS, **HOME, **TURN, "encoder.lines": "10000", "encoder.rate": "40e6 counts/s"}
    tree = DEFAULT.with_({**fine, "homing.on": "home+index"})
    touch, stop = homing.touch(tree), homing.stop(tree)
    assert touch.seek is not None
    assert touch.speed == stop.speed  # nothing is in its way
    assert touch.slow == pytest.approx(5e-3)  # 5 um of scatter in 1 ms
    assert touch.seek.rise == pytest.approx(50e-3) and touch.seek.rise < touch.speed
    back = 4.0 * tree.switches.repeatability + 50e-3**2 / tree.motion.acceleration
    assert touch.back == pytest.approx(back + 4.0 * tree.encoder.pitch)
    way = 310e-3
    took = 2.0 * way / touch.speed + touch.back / 5e-3 + way / 50e-3
    assert touch.patience == pytest.approx(5.0 * took + 10.0)
    assert touch[2:6] == stop[2:6]  # effort, lead, stand, give
    # 0.1 mm to the stop: it turns within half of that.
    near = {**fine, "homing.on": "limit", "switches.low": "-4.9 mm"}
    tree = DEFAULT.with_(near)
    assert homing.speed(tree) == pytest.approx((tree.motion.acceleration * 1e-4) ** 0.5)
    assert homing.speed(tree) < homing.stop(tree).speed
    # Of a home switch the way to the stop is of no interest; nor is there any at the stop itself.
    home = DEFAULT.with_({**near, "homing.on": "home"})
    assert homing.speed(home) == homing.stop(home).speed
    at_stop = DEFAULT.with_({**near, "switches.low": "-5 mm"})
    assert homing.speed(at_stop) == homing.stop(at_stop).speed


def test_a_pulse_per_turn_of_a_linear_motor_is_told_as_such() -> None:
    changes = {**TURN, **HOME, **LINEAR, "homing.on": "home+index"}
    with pytest.raises(InputError, match="only an encoder on a motor that turns"):
        DEFAULT.with_(changes)
