"""What the station's events say is in force."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from macromicro.control.live import messages as m
from macromicro.serve._ledger import EVENTS, InForce, Ledger, Trail
from macromicro.serve.settings import LiveSettings


def test_speeds_are_those_last_set_until_the_loop_begins_anew() -> None:
    """Of one stage, which may turn, or of each axis of two."""

    def told(kind: str, cause: str, **facts: Any) -> m.Event:
        return m.Event(1.0, kind, "ready", "ready", cause, facts)

    def speeds(own: dict[str, float], *events: m.Event) -> dict[str, float]:
        found = InForce(SimpleNamespace(controller=None, facts=SimpleNamespace(speeds=own)))  # type: ignore[arg-type]
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


def test_gains_stay_in_force_however_many_events_follow() -> None:
    """Events are kept up to a number; what they have changed is not forgotten with them."""
    settings = LiveSettings()
    ledger = Ledger(Trail(), InForce(settings))
    ledger.event(m.Event(0.0, "gains", "", "", "set gains", {"dead_zone": {"new": 2.5}}))
    for _ in range(EVENTS):
        ledger.event(m.Event(0.0, "fan", "", "", "fan", {"on": True}))
    assert all(event.kind == "fan" for event in ledger.events(-1)[1])
    assert ledger.in_force.control.dead_zone == 2.5
