"""Changes of what a viewer sees: the newest in its turn, a few a second."""

from __future__ import annotations

import struct
from collections.abc import Callable

from web_parts import Client

from macromicro.serve.web.server import Bounds
from tests.waiting import until

Make = Callable[..., Client]


def test_of_many_wanted_views_the_newest_is_shown(client: Make) -> None:
    viewer = client({"view": 1, "span": 60.0}, bounds=Bounds(views=2.0))
    numbers = [viewer.begin("view", view=k, span=60.0, columns=600) for k in range(2, 42)]
    assert viewer.reply(numbers[-1])["ok"]
    assert all(viewer.reply(number)["ok"] for number in numbers)  # none is refused
    until(lambda: viewer.read() or _views(viewer)[-1:] == [41])
    whole = [f for f in viewer.frames if struct.unpack_from("<4I", f)[2] > 20]
    assert 2 <= len(whole) <= 4  # that of the hello, the first one, the last one


def test_a_stop_drops_no_view(client: Make) -> None:
    viewer = client(bounds=Bounds(views=2.0))
    numbers = [viewer.begin("view", view=k, span=2.0, columns=100) for k in (2, 3)]
    assert viewer.order("stop")["ok"]
    assert all(viewer.reply(number)["ok"] for number in numbers)


def _views(viewer: Client) -> list[int]:
    return [struct.unpack_from("<4I", frame)[1] for frame in viewer.frames]
