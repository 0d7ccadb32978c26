"""What is done about a request that comes late, or behind an emergency stop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.control.live import messages as m
from macromicro.serve import requests
from macromicro.serve.requests import OVERTAKEN, TOO_LATE, Order

ALWAYS = (m.Stop(), m.EmergencyStop(), m.LinkLost(), m.Disable(), m.Jog("macro", 0), m.Jog("x", 0))
MOTIONS = (m.Home(), m.MoveTo(0.1), m.MoveBy(0.1), m.MoveMacro(5), m.MoveMicro(1.0))
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
