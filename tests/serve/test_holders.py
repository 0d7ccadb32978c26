"""Who may hold control."""

from __future__ import annotations

import pytest

from macromicro.control.live.messages import Accepted, Refused
from macromicro.errors import InputError
from macromicro.serve._holders import Holders


def test_nobody_without_a_name_holds_control() -> None:
    holders = Holders(5.0)
    assert isinstance(holders.acquire(""), Refused)
    with pytest.raises(InputError, match="has no name"):
        holders.connect("")
    assert not holders.disconnect("")
    assert (holders.holder, holders.clients) == ("", ())
    assert isinstance(holders.acquire("one"), Accepted)
    assert isinstance(holders.acquire(""), Refused)
    assert holders.holder == "one"
    assert not holders.disconnect("")
