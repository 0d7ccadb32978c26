"""The state in plain values."""

from __future__ import annotations

import json
import math

import numpy as np
from web_parts import Station

from macromicro.control.live import messages as m
from macromicro.control.settings import Control
from macromicro.schema.par import entries
from macromicro.serve._instrument import Instrument
from macromicro.serve.web import _reporting
from macromicro.serve.web._hub import KEPT, Hub

NAN = math.nan


def test_plain_values_are_json() -> None:
    value = {"a": np.float64(1.5), "b": np.int64(2), "c": (NAN, math.inf), 3: Control}
    found = _reporting.plain(value)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert (found["a"], found["b"], found["c"]) == (1.5, 2, [None, None])


def test_every_setting_has_its_bounds() -> None:
    told = _reporting.settings(Control())
    assert [t["path"] for t in told] == [e.path for e in entries(Control())]
    low = {t["path"]: t["low"] for t in told}
    assert low["sequence.tolerance"] == 0.0 and low["sequence.patience"] == 0.1
    assert all(t["high"] is not None for t in told if t["kind"] != "choice")
    kinds = {t["path"]: t["kind"] for t in told}
    assert (kinds["macro_law"], kinds["sequence.park"]) == ("choice", "whole")
    json.dumps(told, allow_nan=False)


def test_the_page_has_gains_in_volts_per_mm_and_contractions_in_mm() -> None:
    told = {t["path"]: t for t in _reporting.settings(Control())}
    assert [told["pi_antiwindup.kp"][k] for k in ("value", "unit", "high")] == [3.0, "V/mm", 1e3]
    fake = Station()
    state = _reporting.state(fake.snapshot(), fake.settings.live)
    assert state["micro_mm"] == 0.31
    assert (state["limits"]["micro_high"], state["limits"]["whole_high"]) == (3.5, 0.2169)
    page = _reporting.limits(fake.settings)
    assert (page["micro_high"], page["whole_low"]) == (3.5, -8.8e-3)


def test_the_hub_keeps_the_last_news_only() -> None:
    fake = Station()
    hub = Hub(Instrument(fake))  # type: ignore[arg-type]
    for _ in range(3 * KEPT):
        fake.go("ready")
    hub.look({})
    assert len(hub.news) == KEPT
    last, text = hub.after(0)
    assert last == 3 * KEPT and len(json.loads(text)["news"]) == KEPT
    assert hub.after(last) == (last, "")


def test_the_hub_follows_gains_and_another_loop() -> None:
    fake = Station()
    hub = Hub(Instrument(fake))  # type: ignore[arg-type]
    facts = {"sequence.wait": {"old": 2.0, "new": 1.5}, "no.such": {"old": 0, "new": 1}}
    fake.told.append(m.Event(0.0, "gains", "ready", "ready", "set gains", facts))
    hub.look({})
    assert hub.control.sequence.wait == 1.5
    fake.told.append(m.Event(0.0, "loop", "", "", "started", {}))
    hub.look({})
    assert hub.control == fake.settings.controller


def test_the_hub_tells_every_end_once() -> None:
    fake = Station()
    hub = Hub(Instrument(fake))  # type: ignore[arg-type]
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


def test_the_ends_of_motions_stand_among_the_events_by_their_time() -> None:
    fake = Station()
    hub = Hub(Instrument(fake))  # type: ignore[arg-type]
    fake.told += [m.Event(t, "mode", "ready", "ready", "", {}) for t in (1.0, 2.5, 3.0)]
    fake.ended[1] = m.Finished(1, m.DONE, 0.0, 0.0, {}, 2.0)
    fake.ended[2] = m.Finished(2, m.DONE, 0.0, 0.0, {}, 3.0)
    hub.follow()
    fake.told += [m.Event(4.0, "mode", "ready", "ready", "", {})]
    fake.ended[3] = m.Finished(3, m.DONE, 0.0, 0.0, {}, 3.5)
    hub.follow()
    news = json.loads(hub.after(0)[1])["news"]
    assert [item["time"] for item in news] == [1.0, 2.0, 2.5, 3.0, 3.0, 3.5, 4.0]
