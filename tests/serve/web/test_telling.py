"""The state in plain values: targets above all, which no single reading tells."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from web_parts import Station

from macromicro.control.live import messages as m
from macromicro.control.settings import Control
from macromicro.parameters import entries
from macromicro.serve.web import telling
from macromicro.serve.web.hub import KEPT, Hub

PITCH = 0.2 / 2800.0
NAN = math.nan


def begun(cause: str, to_mode: str = "moving-macro", **evidence: Any) -> m.Event:
    return m.Event(1.0, "mode", "ready", to_mode, cause, evidence)


def test_a_move_of_both_stages_keeps_its_target_to_the_end() -> None:
    target = telling.aimed(begun("macro move", target_m=0.05), NAN)
    for to_mode, cause in (("settling", "arrived"), ("moving-micro", "settled")):
        target = telling.aimed(begun(cause, to_mode), target)
    target = telling.aimed(begun("on target", "holding"), target)
    assert target == 0.05
    assert telling.aimed(m.Event(1.0, "fan", "holding", "holding", "fan", {}), target) == 0.05
    assert math.isnan(telling.aimed(begun("micro move", "moving-micro", micro_mm=1.0), target))
    assert math.isnan(telling.aimed(begun("programme"), target))
    assert math.isnan(telling.aimed(begun("emergency stop", "disabled"), target))


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
    fake = Station()
    fake.mode = mode
    found = telling.aim(fake.snapshot(), told, PITCH)
    assert found == pytest.approx(wanted, nan_ok=True)


def test_plain_values_are_json() -> None:
    value = {"a": np.float64(1.5), "b": np.int64(2), "c": (NAN, math.inf), 3: Control}
    found = telling.plain(value)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert (found["a"], found["b"], found["c"]) == (1.5, 2, [None, None])


def test_every_setting_has_its_bounds() -> None:
    told = telling.settings(Control())
    assert [t["path"] for t in told] == [e.path for e in entries(Control())]
    low = {t["path"]: t["low"] for t in told}
    assert low["sequence.tolerance"] == 0.0 and low["sequence.patience"] is None
    kinds = {t["path"]: t["kind"] for t in told}
    assert (kinds["macro_law"], kinds["sequence.park"]) == ("choice", "whole")
    json.dumps(told, allow_nan=False)


def test_the_hub_keeps_the_last_news_only() -> None:
    fake = Station()
    hub = Hub(fake)  # type: ignore[arg-type]
    for _ in range(3 * KEPT):
        fake.go("ready")
    hub.look({})
    assert len(hub.news) == KEPT
    last, text = hub.after(0)
    assert last == 3 * KEPT and len(json.loads(text)["news"]) == KEPT
    assert hub.after(last) == (last, "")


def test_the_hub_follows_gains_and_another_loop() -> None:
    fake = Station()
    hub = Hub(fake)  # type: ignore[arg-type]
    facts = {"sequence.wait": {"old": 2.0, "new": 1.5}, "no.such": {"old": 0, "new": 1}}
    fake.told.append(m.Event(0.0, "gains", "ready", "ready", "set gains", facts))
    hub.look({})
    assert hub.control.sequence.wait == 1.5
    fake.told.append(m.Event(0.0, "loop", "", "", "started", {}))
    hub.look({})
    assert hub.control == fake.settings.controller


def test_the_hub_tells_every_end_once() -> None:
    fake = Station()
    hub = Hub(fake)  # type: ignore[arg-type]
    fake.holder = "a"
    for _ in range(3):
        fake.request("a", m.Home())
        fake.end("done")
    hub.look({})
    hub.look({})
    items = json.loads(hub.after(0)[1])["news"]
    assert [item["id"] for item in items if item["kind"] == "finished"] == [1, 2, 3]
    numbers = [item["event"] for item in items]
    assert numbers == sorted(set(numbers))
