"""The limits of a board's own guard behind a machine of one stage."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from macromicro.errors import InputError
from macromicro.machines import board_limits, machine
from macromicro.rig.limits import NEVER

PRINTER = Path(__file__).parents[2] / "examples" / "machines" / "printer.toml"


def tree(**guard: Any) -> Any:
    found = machine.load(PRINTER)[1]
    return found._replace(guard=found.guard._replace(**guard))


def test_they_are_the_machines_with_room_for_the_hosts_guard_to_be_first() -> None:
    own = tree(against=0.01, stuck=0.3, push=3.5, lean=2.0, leap=2.0, clock=0.5)
    found, pitch = board_limits.of(own), own.encoder.pitch
    assert (found.motor, found.push, found.lean) == (own.guard.effort, 3.5, 2.0)
    assert found.stuck == pytest.approx(0.6) and found.clock == pytest.approx(1.0)
    assert found.against == pytest.approx(0.02 / pitch)
    assert found.fastest == pytest.approx(4.0 / pitch)


def test_homing_may_lean_on_its_stop() -> None:
    own = tree(leant=0.1)
    to_stop = own._replace(homing=own.homing._replace(on="stop"))
    at_start = own._replace(homing=own.homing._replace(on="start"))
    assert board_limits.of(at_start).leant == pytest.approx(0.2)
    assert board_limits.of(to_stop).leant > 0.2 + 2.0 * 0.3  # it stands there for 0.3 s


def test_what_the_machine_does_not_watch_the_board_does_not_either() -> None:
    found = board_limits.of(tree(lean=0.0, against=0.0, leap=0.0))
    assert (found.lean, found.against, found.fastest) == (NEVER, NEVER, NEVER)


def test_more_effort_than_a_board_has_is_refused_with_the_remedy() -> None:
    with pytest.raises(InputError, match=r"guard\.effort.*at most 5 V.*amplifier\.full_scale"):
        board_limits.of(tree(effort=10.0))
