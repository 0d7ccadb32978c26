"""What the station's events say is in force."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from macromicro.control.live import messages as m
from macromicro.serve._in_force import InForce


def test_speeds_are_those_last_set_until_the_loop_begins_anew() -> None:
    """Of one stage, which may turn, or of each axis of two."""

    def told(kind: str, cause: str, **facts: Any) -> m.Event:
        return m.Event(1.0, kind, "ready", "ready", cause, facts)

    def speeds(own: dict[str, float], *events: m.Event) -> dict[str, float]:
        found = InForce(SimpleNamespace(controller=None, speeds=own))  # type: ignore[arg-type]
        for event in events:
            found.follow(event)
        return {stage: found.speed(stage) for stage in own}

    own = {"x": 0.2, "y": 0.3}
    changed = told("speed", "set speed", y_speed_m_per_s=0.1)
    assert speeds(own, changed) == {"x": 0.2, "y": 0.1} and own["y"] == 0.3
    assert speeds(own, changed, told("fan", "fan", on=True)) == {"x": 0.2, "y": 0.1}
    assert speeds(own, changed, told("loop", "started")) == own
    for base in ("m", "rad"):
        event = told("speed", "set speed", **{f"speed_{base}_per_s": 0.5})
        assert speeds({"macro": 1.0}, event) == {"macro": 0.5}
