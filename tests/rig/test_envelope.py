"""The envelope of a following error, number by number."""

from __future__ import annotations

import math

import pytest

from macromicro.rig.envelope import Bounds, Envelope, follow, no_set_point

P = Bounds(margin=60.0, tolerance=150.0, rate=500.0, grace=0.5)


def test_nothing_followed_is_closed() -> None:
    for s in (no_set_point(), follow(P, Envelope(3.0, 9.0, 0.2), 0.0, 3.0, 1.0, 0.1)):
        assert math.isnan(s.reference) and (s.allowed, s.timer) == (0.0, 0.0)


@pytest.mark.parametrize(("error", "allowed"), [(400.0, 460.0), (91.0, 151.0), (10.0, 150.0)])
def test_a_new_reference_opens_it(error: float, allowed: float) -> None:
    for before in (no_set_point(), Envelope(2.0, 7.0, 3.0)):
        assert follow(P, before, 1.0, 5.0, error, 0.1) == Envelope(5.0, allowed, 0.0)


def test_it_stands_for_the_grace_then_closes_to_the_tolerance() -> None:
    s = follow(P, Envelope(5.0, 460.0, 0.25), 1.0, 5.0, 1e9, 0.25)
    assert s == Envelope(5.0, 460.0, 0.5)
    s = follow(P, s, 1.0, 5.0, 1e9, 0.25)
    assert s == Envelope(5.0, 335.0, 0.5)
    for _ in range(3):
        s = follow(P, s, 1.0, 5.0, 0.0, 0.25)
    assert s == Envelope(5.0, 150.0, 0.5)
