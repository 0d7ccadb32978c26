"""Messages of a viewer: what becomes of good and of bad ones."""

from __future__ import annotations

from typing import Any

import pytest
from web_parts import Station

from macromicro.control.live import messages as m
from macromicro.control.settings import Control
from macromicro.serve._instrument import Instrument
from macromicro.serve.settings import LiveSettings
from macromicro.serve.web._orders import Orders, Refusal, keys, read_object, surplus

ORDERS = Orders(Instrument(Station()))  # type: ignore[arg-type]


def request(**order: Any) -> Any:
    assert ORDERS.knows(order["do"])
    return ORDERS.request(order)


@pytest.mark.parametrize(
    ("order", "wanted"),
    [
        ({"do": "enable"}, m.Enable()),
        ({"do": "move to", "value": 42.5, "unit": "mm"}, m.MoveTo(pytest.approx(0.0425))),
        ({"do": "move by", "value": -3, "unit": "um"}, m.MoveBy(pytest.approx(-3e-6))),
        ({"do": "move macro", "value": 700}, m.MoveMacro(700.0)),
        ({"do": "move macro", "value": 7, "replace": True}, m.MoveMacro(7.0, "", True)),
        ({"do": "move macro", "value": 7, "replace": False}, m.MoveMacro(7.0)),
        (
            {"do": "move to", "value": 2, "unit": "mm", "replace": True},
            m.MoveTo(pytest.approx(0.002), "", True),
        ),
        (
            {"do": "move by", "value": 2, "unit": "mm", "replace": True},
            m.MoveBy(pytest.approx(0.002), "", True),
        ),
        (
            {"do": "move micro", "value": 2, "unit": "mm", "replace": True},
            m.MoveMicro(pytest.approx(2e-3), "", True),
        ),
        ({"do": "move micro", "value": 0.5, "unit": "mm"}, m.MoveMicro(pytest.approx(0.5e-3))),
        ({"do": "jog", "stage": "micro", "speed": 1e-4}, m.Jog("micro", 1e-4)),
        ({"do": "fan", "on": True}, m.Fan(True)),
        ({"do": "clear"}, m.ClearFault()),
    ],
)
def test_orders_become_requests_in_the_machines_units(order: dict[str, Any], wanted: Any) -> None:
    assert request(**order) == wanted


@pytest.mark.parametrize(
    "order",
    [
        {"do": "move to", "value": 42.5},
        {"do": "move macro", "value": 7, "replace": 1},
        {"do": "move macro", "value": 7, "replace": "yes"},
        {"do": "move to", "value": 42.5, "unit": "inch"},
        {"do": "move to", "value": 42.5, "unit": ["mm"]},
        {"do": "move to", "value": "42.5", "unit": "mm"},
        {"do": "move to", "value": True, "unit": "mm"},
        {"do": "move to", "value": 10**400, "unit": "mm"},
        {"do": "move macro"},
        {"do": "jog", "stage": 7, "speed": 0.1},
        {"do": "jog", "stage": "macro", "speed": None},
        {"do": "fan", "on": 1},
        {"do": "programme", "name": "../../etc/passwd"},
        {"do": "programme"},
        {"do": "gains"},
        {"do": "gains", "changes": []},
        {"do": "gains", "changes": [["pd_tuned.now", 1]]},
        {"do": "gains", "changes": [["sequence.wait", 2.0, None]]},
        {"do": "gains", "changes": [["sequence.wait", 2.0, 10**400]]},
        {"do": "gains", "changes": [["sequence.wait", 2.0, "x" * 201]]},
        {"do": "move micro", "value": 1e307, "unit": "m"},
        {"do": "limits"},
        {"do": "limits", "whole_low": 0.0},
    ],
)
def test_bad_orders_are_refused(order: dict[str, Any]) -> None:
    with pytest.raises(Refusal) as refusal:
        request(**order)
    assert refusal.value.reply.reason


@pytest.mark.parametrize(
    "text",
    ["", "x", "[1]", "7", '{"a": NaN}', '{"a": Infinity}', "[" * 9000, '{"a": ' + "9" * 5000 + "}"],
)
def test_what_is_no_message_is_refused(text: str) -> None:
    with pytest.raises(Refusal):
        read_object(text)
    with pytest.raises(Refusal):
        read_object(text.encode())


def test_shipped_programmes_fit_the_soft_limits() -> None:
    plan = request(do="programme", name="thesis").plan
    assert len(plan.target) > 0


def test_gains_that_somebody_else_has_changed_are_refused() -> None:
    wait = Control().sequence.wait
    changes = [["sequence.wait", wait, 1.0]]
    assert request(do="gains", changes=changes) == m.SetGains((("sequence.wait", 1.0),))
    with pytest.raises(Refusal, match="by now"):
        request(do="gains", changes=[["sequence.wait", wait + 1.0, 1.0]])


def test_gains_of_the_micro_stage_come_in_volts_per_mm() -> None:
    wanted = m.SetGains((("pi_antiwindup.kp", 1500.0), ("pi_antiwindup.ki", 45e3)))
    changes = [["pi_antiwindup.kp", 3.0, 1.5], ["pi_antiwindup.ki", 30.0, 45.0]]
    assert request(do="gains", changes=changes) == wanted


def test_unknown_orders_are_not_known() -> None:
    assert not ORDERS.knows("link lost") and not ORDERS.knows(None) and not ORDERS.knows(["a"])


def test_soft_limits_are_given_whole_or_not_at_all() -> None:
    own = LiveSettings().live.limits
    values = own._asdict() | {
        "micro_low": 0.0,
        "micro_high": 3.5,
        "whole_high": 0.1,
    }  # mm of the micro-stage
    assert request(do="limits", values=values) == m.SetLimits(own._replace(whole_high=0.1))
    assert request(do="limits", values=None) == m.SetLimits(None)
    for wrong in ({"whole_low": 0.0}, [1, 2], "all", {**values, "more": 1.0}):
        with pytest.raises(Refusal, match="not soft limits"):
            request(do="limits", values=wrong)
    with pytest.raises(Refusal, match="not a finite number"):
        request(do="limits", values={**values, "micro_low": None})


def test_a_programme_is_held_to_the_limits_in_force() -> None:
    """Not to those that the server was started with: they may have been narrowed since."""
    station = Station()
    orders = Orders(Instrument(station))  # type: ignore[arg-type]
    station.acquire("a")
    narrow = station.settings.live.limits._replace(macro_high=100.0)
    assert isinstance(station.request("a", m.SetLimits(narrow)), m.Accepted)
    with pytest.raises(Refusal, match=r"^thesis\.toml"):  # and not where it lies on the server
        orders.request({"do": "programme", "name": "thesis"})


@pytest.mark.parametrize("what", sorted(keys()))
def test_keys_that_an_order_does_not_know_are_refused_by_name(what: str) -> None:
    """Numbers beside instead of within `values` say that something else was meant."""
    known = dict.fromkeys(("do", "id", *keys()[what]), 1) | {"do": what}
    assert surplus(known) is None
    refused = surplus({**known, "macro_low": 600, "hi": 2})
    assert refused is not None and "macro_low, hi" in refused.reason
    assert all(key in refused.remedy for key in keys()[what])


@pytest.mark.parametrize("what", ["nonsense", 7, None])
def test_what_is_no_order_has_no_keys(what: Any) -> None:
    assert surplus({"do": what, "more": 1}) is None
