"""Checks that homing and jogs give up before the guard declares the carriage stuck."""

from __future__ import annotations

from typing import Any

from macromicro.control.live.parameters import Live

SHARE = 0.9  # of guard.leant that they may use up: periods may be late


def longest(live: Live) -> float:
    """The longest time that homing pushes against a stop without a count."""
    return 2.0 * live.homing.stand


def problems(live: Live, lean: float, leant: float) -> list[tuple[str, Any, str]]:
    homing, jogging = live.homing, live.jogging
    found: list[tuple[str, Any, str]] = []
    if longest(live) > SHARE * leant:
        most = 0.5 * SHARE * leant
        words = f"at most {most:.4g} s, for homing leans on the stop twice as long, and "
        found.append(("live.homing.stand", homing.stand, words + _GUARD))
    if jogging.patience > SHARE * leant:
        words = f"at most {SHARE * leant:.4g} s, for "
        found.append(("live.jogging.patience", jogging.patience, words + _GUARD))
    if jogging.lean > lean:
        found.append(("live.jogging.lean", jogging.lean, "at most {guard.lean}"))
    return found


_GUARD = "{guard.leant} is the guard's limit, of which 90 % may be used"
