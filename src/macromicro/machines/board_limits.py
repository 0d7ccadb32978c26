"""Limits of a board's own guard behind the host's: twice as wide, so that the host trips first."""

from __future__ import annotations

from typing import Any

from macromicro.errors import InputError
from macromicro.machines import homing
from macromicro.nominal import FULL_SCALE
from macromicro.rig.limits import NEVER, Limits

SLACK = 2.0
# For an unidentified stage: only limit switches, a silent host and illegal outputs stop it.
UNKNOWN = Limits()._replace(push=NEVER, lean=NEVER, against=NEVER, fastest=NEVER)


def of(tree: Any) -> Limits:
    guard, pitch = tree.guard, float(tree.encoder.pitch)
    if guard.effort > FULL_SCALE:
        accepted = (
            f"at most {FULL_SCALE:g} V, the full duty of a board's output: "
            f"amplifier.full_scale = {FULL_SCALE:g} V"
        )
        raise InputError("guard.effort", f"{guard.effort:g} V", accepted)
    touch = homing.touch(tree) if hasattr(tree, "homing") else None
    stands = guard.leant + (touch.stand + touch.reveal if touch is not None else 0.0)
    return Limits()._replace(
        motor=guard.effort,
        push=guard.push,
        stuck=SLACK * guard.stuck,
        lean=guard.lean or NEVER,
        leant=SLACK * stands,
        against=SLACK * guard.against / pitch or NEVER,
        fastest=SLACK * guard.leap / pitch or NEVER,
        clock=SLACK * guard.clock,
    )
