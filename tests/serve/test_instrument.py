"""What the station's events say is in force."""

from __future__ import annotations

from typing import Any

from macromicro.control.live import messages as m
from macromicro.serve._instrument import speeds_after


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
