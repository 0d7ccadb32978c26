"""Two axes follow streamed points, each within its limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from tests.serve.group.bed import Bed

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted, Event, Finished, Refused

DT, HOLD = 1e-3, 0.05


def put(bed: Bed, *point: tuple[float, float]) -> None:
    bed.notices += bed.pair.heard(point, 0.0)
    bed.run(1)


def ended(bed: Bed, number: int) -> Finished:
    bed.run(5000, to_end=True)
    (end,) = (n for n in bed.notices if isinstance(n, Finished) and n.id == number)
    return end


@pytest.fixture
def bed() -> Bed:
    bed = Bed()
    bed.done(m.MovePoint({"x": 0.05, "y": 0.05}))
    return bed


def test_a_circle_is_followed_and_ended(bed: Bed) -> None:
    w, size, off = math.pi, 5e-3, []
    assert bed.ask(m.Follow("all", HOLD)) == Accepted(2)
    for k in range(2000):
        t = k * DT
        x, y = 0.05 + size * math.sin(w * t), 0.05 + size * (1.0 - math.cos(w * t))
        put(bed, (x, size * w * math.cos(w * t)), (y, size * w * math.sin(w * t)))
        off.append(math.dist(bed.place, (x, y)))
    assert np.max(off[500:]) < 0.02 * size
    put(bed, (0.051, 0.0), (0.052, 0.0))
    assert bed.ask(m.EndFollow()) == Accepted(2)
    assert ended(bed, 2).outcome == m.DONE
    assert bed.place == pytest.approx((0.051, 0.052), abs=2e-5)


def test_one_axis_follows_alone_and_the_other_stands(bed: Bed) -> None:
    assert isinstance(bed.ask(m.EndFollow()), Refused)
    assert bed.ask(m.Follow("y", HOLD)) == Accepted(2)
    x = bed.place[0]
    for k in range(300):
        put(bed, (0.05 + 0.01 * k * DT, 0.01))
    assert bed.place[1] > 0.0525 and bed.place[0] == pytest.approx(x, abs=1e-5)
    assert ended(bed, 2).outcome == m.LOST
    causes = [n.cause for n in bed.notices if isinstance(n, Event) and n.kind == "mode"]
    assert causes[-1] == "hold time over"


def test_both_come_to_rest_once_no_point_comes(bed: Bed) -> None:
    bed.ask(m.Follow("all", HOLD))
    for k in range(300):
        put(bed, (0.05 + 0.03 * k * DT, 0.03), (9.0, 0.0))  # y is clipped
    told = [n for n in bed.notices if isinstance(n, Event) and n.kind == "follow"]
    assert len(told) == 1 and "y_position_mm" in told[0].evidence
    assert ended(bed, 2).outcome == m.LOST
    assert isinstance(bed.ask(m.Follow("z", HOLD)), Refused)
    reply = bed.ask(m.Follow("all", 2.0))
    assert isinstance(reply, Refused) and "0.01 to 1 s" in reply.remedy
    bed.ask(m.Jog("x", 0.01, 0.1))
    bed.run(80)
    bed.pair.renew()
    bed.run(80)
    assert bed.pair.view().motion == 3
    assert ended(bed, 3).outcome == m.LOST
