"""The table of requests is what both protocols are made from."""

from __future__ import annotations

import asyncio
from typing import Any, NamedTuple

import numpy as np
import pytest
from fake_station import FakeStation

from macromicro.control.live import messages as m
from macromicro.serve import requests
from macromicro.serve._instrument import Instrument
from macromicro.serve.client import Capacity
from macromicro.serve.requests import (
    CONTROL,
    KINDS,
    OVERTAKEN,
    REQUESTS,
    STOPS,
    TOO_LATE,
    Field,
    Order,
    RequestType,
)
from macromicro.serve.scpi import _motion
from macromicro.serve.scpi._message import Tree, parse
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.server import attempt
from macromicro.serve.scpi.tree import COMMANDS
from macromicro.serve.web._orders import Orders, Refusal


class Park(NamedTuple):
    """A request that no protocol has heard of."""

    place: float
    fan: bool
    client: str = ""


PARK = RequestType(
    "park",
    Park,
    "PARK",
    "Away from here.",
    (Field("place", "m", -1.0, 1.0), Field("fan", key="fan")),
)


@pytest.fixture
def station() -> Any:
    station = FakeStation()
    station.acquire("test")
    return station


def test_every_request_of_a_client_is_in_the_table() -> None:
    assert {kind.message for kind in REQUESTS} == {*m.Request.__args__} - {m.LinkLost}  # type: ignore[attr-defined]
    assert len(KINDS) == len(REQUESTS)
    stops = {kind.message for kind in REQUESTS if kind.access == STOPS}
    assert stops == {m.Stop, m.EmergencyStop}


@pytest.mark.parametrize("kind", REQUESTS, ids=lambda kind: kind.name)
def test_every_request_is_a_command_and_an_order(kind: RequestType, station: Any) -> None:
    found = [c for c in COMMANDS if c.header in {x.header for x in _motion.commands(kind.name)}]
    assert found and {c.access for c in found} == {kind.access}
    assert Orders(Instrument(station)).knows(kind.name)


def test_a_new_request_is_one_line_of_the_table(
    station: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(KINDS, PARK.name, PARK)
    instrument = Instrument(station)
    session = Session(instrument, "test", "127.0.0.1", Capacity(1, 1))
    (unit,) = parse(Tree(_motion.commands("park")), b"PARK 5 MM, ON").units
    assert unit.command.access == CONTROL
    asyncio.run(attempt(session, unit, session.stops, session.failed))
    assert station.requests == [Park(0.005, True, "test")]
    order = {"do": "park", "value": 5, "unit": "mm", "fan": True}
    assert Orders(instrument).request(order) == Park(pytest.approx(0.005), True)  # type: ignore[comparison-overlap]
    with pytest.raises(Refusal):
        Orders(instrument).request({**order, "fan": 1})
    assert parse(Tree(_motion.commands("park")), b"PARK 5, ON").error is not None


ALWAYS = (m.Stop(), m.EmergencyStop(), m.LinkLost(), m.Disable(), m.Jog("macro", 0), m.Jog("x", 0))
MOTIONS = (m.Home(), m.MoveTo(0.1), m.MoveBy(0.1), m.MoveMacro(5), m.MoveMicro(1e-3))
JOGS = (m.Jog("macro", 0.1), m.Jog("macro", "x"), m.Jog("micro", np.zeros(2)))  # type: ignore[arg-type]
OTHERS = (m.Enable(), m.Fan(True), m.ClearFault(), m.SetGains(()), m.Zero())


@pytest.mark.parametrize("request_", ALWAYS)
def test_what_ends_is_always_done(request_: Any) -> None:
    assert requests.ends(request_)
    assert not requests.moves(request_)
    assert requests.void(Order(1, request_, 10, 20), 15, 30) is None


@pytest.mark.parametrize("request_", (*MOTIONS, *JOGS, *OTHERS))
def test_everything_else_has_its_time(request_: Any) -> None:
    order = Order(1, request_, 10, 20)
    assert not requests.ends(request_)
    assert requests.moves(request_) is any(request_ is x for x in (*MOTIONS, *JOGS))
    assert requests.void(order, 9, 20) is None
    assert requests.void(order, 9, 21) == TOO_LATE
    assert requests.void(order, 10, 11) == OVERTAKEN
