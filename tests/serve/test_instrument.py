"""Targets of the whole positioner, which no single reading tells."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from macromicro.control.live import messages as m
from macromicro.serve.instrument import speeds_after, target_after, target_now

PITCH = 0.2 / 2800.0
NAN = math.nan


def begun(cause: str, to_mode: str = "moving-macro", **evidence: Any) -> m.Event:
    return m.Event(1.0, "mode", "ready", to_mode, cause, evidence)


def test_a_move_of_both_stages_keeps_its_target_to_the_end() -> None:
    target = target_after(begun("macro move", target_m=0.05), NAN)
    for to_mode, cause in (("settling", "arrived"), ("moving-micro", "settled")):
        target = target_after(begun(cause, to_mode), target)
    target = target_after(begun("on target", "holding"), target)
    assert target == 0.05
    assert target_after(m.Event(1.0, "fan", "holding", "holding", "fan", {}), target) == 0.05
    assert math.isnan(target_after(begun("micro move", "moving-micro", micro_mm=1.0), target))
    assert math.isnan(target_after(begun("programme"), target))
    assert math.isnan(target_after(begun("emergency stop", "disabled"), target))


@pytest.mark.parametrize(
    ("mode", "told", "wanted"),
    [
        ("moving-macro", NAN, 589.0 * PITCH),  # the set point of the macro-stage
        ("holding", NAN, 590.0 * PITCH + 0.3e-3),  # where it stands, and the micro set point
        ("holding", 0.0425, 0.0425),
        ("ready", 0.0425, NAN),
        ("homing", NAN, NAN),
        ("fault", 0.0425, NAN),
    ],
)
def test_the_target_is_where_it_goes_or_is_held(mode: str, told: float, wanted: float) -> None:
    now: Any = SimpleNamespace(
        mode=mode, macro_count=590.0, macro_reference=589.0, micro_reference_m=0.3e-3
    )
    found = target_now(now, told, PITCH)
    assert found == pytest.approx(wanted, nan_ok=True)


def test_speeds_are_those_last_set_until_the_loop_begins_anew() -> None:
    """Of one stage, which may turn, or of each axis of two."""

    def told(kind: str, cause: str, **facts: Any) -> m.Event:
        return m.Event(1.0, kind, "ready", "ready", cause, facts)

    own = {"x": 0.2, "y": 0.3}
    changed = speeds_after(told("speed", "set speed", y_speed_m_per_s=0.1), own, own)
    assert changed == {"x": 0.2, "y": 0.1} and own["y"] == 0.3
    assert speeds_after(told("fan", "fan", on=True), changed, own) == changed
    assert speeds_after(told("loop", "started"), changed, own) == own
    for base in ("m", "rad"):
        event = told("speed", "set speed", **{f"speed_{base}_per_s": 0.5})
        assert speeds_after(event, {"macro": 1.0}, {"macro": 1.0}) == {"macro": 0.5}
