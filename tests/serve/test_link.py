"""What a process says last is heard, whatever it has left unread."""

from __future__ import annotations

import pytest

from macromicro.serve.link import Outbox, pack, pair, receive


def test_what_was_sent_last_is_heard_though_an_order_was_not_read() -> None:
    ours, theirs = pair()
    outbox = Outbox(theirs)
    ours.send(pack("an order"))
    outbox.send("left")
    outbox.end()
    with pytest.raises(BrokenPipeError):
        ours.send(pack("another one"))
    theirs.close()
    assert receive(ours) == "left"
    with pytest.raises(EOFError):
        receive(ours)
    ours.close()
