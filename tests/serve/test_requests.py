"""The table of requests is what both protocols are made from."""

from __future__ import annotations

from typing import Any, NamedTuple

import pytest
from fake_station import FakeStation

from macromicro.control.live import messages as m
from macromicro.serve.instrument import Instrument
from macromicro.serve.requests import CONTROL, KINDS, REQUESTS, STOPS, Field, RequestType
from macromicro.serve.scpi import motion
from macromicro.serve.scpi.execution import attempt
from macromicro.serve.scpi.header import Tree
from macromicro.serve.scpi.message import parse
from macromicro.serve.scpi.session import Session
from macromicro.serve.scpi.tree import COMMANDS
from macromicro.serve.web.orders import Orders, Refusal


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
    found = [c for c in COMMANDS if c.header in {x.header for x in motion.commands(kind.name)}]
    assert found and {c.access for c in found} == {kind.access}
    assert Orders(Instrument(station)).knows(kind.name)


def test_a_new_request_is_one_line_of_the_table(
    station: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(KINDS, PARK.name, PARK)
    instrument = Instrument(station)
    session = Session(instrument, "test")
    (unit,) = parse(Tree(motion.commands("park")), b"PARK 5 MM, ON").units
    assert unit.command.access == CONTROL
    attempt(session, unit, session.stops, session.failed)
    assert station.requests == [Park(0.005, True, "test")]
    order = {"do": "park", "value": 5, "unit": "mm", "fan": True}
    assert Orders(instrument).request(order) == Park(pytest.approx(0.005), True)  # type: ignore[comparison-overlap]
    with pytest.raises(Refusal):
        Orders(instrument).request({**order, "fan": 1})
    assert parse(Tree(motion.commands("park")), b"PARK 5, ON").error is not None
