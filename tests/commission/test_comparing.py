"""Gains by the rules and by a search, both tried on the stage."""

from __future__ import annotations

import math

import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission import _verifying
from macromicro.commission.procedure import Tuned
from macromicro.commission.stand import Stand
from macromicro.machines import machine as machines
from macromicro.schema import config

ROWS = (("settling on the worst model", "10", "50 ms by the rules", "ms"),)
FOUND = Tuned({"controller.position": '"41 1/s"'}, ROWS, ("it was said before",))


def chosen(rules: tuple[float, str], search: tuple[float, str]) -> Tuned:
    order: list[bool] = []

    def tried(one: Tuned) -> tuple[float, str]:
        order.append(bool(one.gains))
        return search if one.gains else rules

    found = _verifying.faster(_verifying.compare(tried, FOUND), FOUND)
    assert order == [False, True]  # what is surely sound first
    return found


def test_gains_that_settle_sooner_on_the_stage_stay() -> None:
    found = chosen((0.04, ""), (0.03, ""))
    assert found.gains == FOUND.gains and found.doubts == FOUND.doubts
    assert found.rows == (("settling on the stage", "30", "40 ms by the rules", "ms"), *ROWS)


@pytest.mark.parametrize("late", [0.039, 0.04, 0.141, math.inf])
def test_gains_that_settle_later_or_hardly_sooner_are_left_out_with_both_figures(
    late: float,
) -> None:
    found = chosen((0.04, ""), (late, ""))
    assert found.gains == {} and found.doubts == FOUND.doubts
    ((name, value, other, unit),) = found.rows
    assert (name, value, unit) == ("settling on the stage", "40", "ms")
    assert other.startswith(f"{1e3 * late:.4g} ms by the search")


def test_where_only_the_search_arrives_it_stays_and_where_neither_does_the_rules() -> None:
    assert chosen((math.inf, ""), (0.1, "")).gains == FOUND.gains
    assert chosen((math.inf, ""), (math.inf, "")).gains == {}


def test_a_guard_that_ended_the_moves_is_told() -> None:
    found = chosen((0.04, ""), (math.inf, "too fast"))
    assert found.gains == {} and found.doubts[0] == FOUND.doubts[0]
    assert "gains of the search" in found.doubts[1] and found.doubts[1].endswith(": too fast")
    found = chosen((math.inf, "too fast"), (0.03, ""))
    assert found.gains == FOUND.gains and "gains of the rules" in found.doubts[1]


# The machine that `PLAIN` is, in volts, as a commissioning would write it.
SHEET = {
    "amplifier": {"mode": "voltage", "gain": 1.0, "full_scale": "8 V", "supply": "8 V",
                  "current": "8 A"},
    "drive": {"kind": "linear"},
    "encoder": {"at": "load", "pitch": "10 um", "rate": "1e8 counts/s"},
    "motor": {"force": "1 N/A", "resistance": "1 ohm", "inductance": "1 uH"},
    "load": {"mass": "0.1 kg", "stop_low": "-1 mm", "stop_high": "98 mm"},
    "friction": {"coulomb": "1 N", "stribeck": "0.2 N", "stribeck_speed": "10 mm/s",
                 "viscous": "4 N*s/m"},
    "timing": {"period": "1 ms", "delay": "1 ms"},
}  # fmt: skip


def settled(**gains: float) -> tuple[float, str]:
    machine = machines.named("axis", "machine")
    tree = config.overridden(machine.settings, SHEET, "found")
    tree = tree._replace(controller=tree.controller._replace(**gains))
    rig = Virtual(PLAIN, late=1, stops=(-0.001, 0.098))
    with session(rig) as there:
        stand = Stand(there, 1e-3, 1e-5)
        assert stand.position() == 0.0
        return _verifying.settling(stand, machine, tree)


def test_the_stage_itself_says_how_soon_it_settles() -> None:
    soon, fault = settled()
    assert 0.0 <= soon < 0.2 and not fault
    late, fault = settled(position=6.0, integral=2.0)
    assert late > 2.0 * soon + 0.05 and not fault


def test_what_the_guard_stops_does_not_settle() -> None:
    took, fault = settled(position=4000.0)
    assert took == math.inf and fault
