"""Direction, breakaway and ends on an axis that is known."""

from __future__ import annotations

import math

import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission._probing import PUSH, Creep, Direction, Ramp, direction, ends, go
from macromicro.commission.stand import SENSOR, SPEED, WINDOW, Caution, CommissionError, Stand
from macromicro.models.mass import Axis

FREE = Caution(10.0, math.inf)


def stand(rig: Virtual) -> Stand:
    return Stand(session(rig), rig.dt, rig.pitch)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_direction_finds_sign_and_breakaway(sign: float) -> None:
    rig = Virtual(sign=sign)
    on = stand(rig)
    found = direction(on, FREE)
    assert found.sign == on.sign == sign
    # Coulomb friction and Stribeck's drop; the ramp goes on for the way of four counts.
    assert found.forward == pytest.approx(1.2, abs=0.02)
    assert found.backward == pytest.approx(1.2, abs=0.02)
    assert found.scatter < 0.02
    assert found.noise == 0.0
    assert rig.most < 1.25
    assert rig.log[-1] == 0.0


def test_a_weight_makes_the_two_directions_differ() -> None:
    rig = Virtual(PLAIN._replace(offset=0.5))
    found = direction(stand(rig), FREE)
    assert found.forward == pytest.approx(1.7, abs=0.02)
    assert found.backward == pytest.approx(0.7, abs=0.02)
    assert found.breakaway == found.forward
    assert (found.friction, found.constant) == pytest.approx((1.2, 0.5), abs=0.02)


@pytest.mark.parametrize(
    ("rig", "words"),
    [
        (Virtual(PLAIN._replace(coulomb=20.0)), "does not move at 10 V"),
        (Virtual(PLAIN._replace(offset=3.0)), "without effort"),
        (Virtual(magnitude=True), "the same way"),
        (Virtual(deaf=0.2), "sensor gives no value"),
    ],
)
def test_what_cannot_be_commissioned_is_said(rig: Virtual, words: str) -> None:
    with pytest.raises(CommissionError, match=words):
        direction(stand(rig), FREE)
    assert rig.effort == 0.0


def test_ends_are_felt_within_the_stops() -> None:
    rig = Virtual()
    on = stand(rig)
    found = direction(on, FREE)
    seen = ends(on, found, FREE._replace(speed=0.02), 0.5)
    assert seen.found
    assert -0.03 < seen.low < -0.03 + 0.021 * 0.1
    assert 0.07 - 0.021 * 0.1 - 1e-5 < seen.high < 0.07
    assert seen.travel == seen.high - seen.low
    assert rig.most <= 1.6 * found.breakaway


def test_no_end_within_the_way_is_said() -> None:
    rig = Virtual(stops=(-1.0, 1.0))
    on = stand(rig)
    found = direction(on, FREE)
    with pytest.raises(CommissionError, match="no end within 50 mm"):
        ends(on, found, FREE._replace(speed=0.05), 0.05)
    assert rig.reached[0] > -0.055
    assert rig.reached[1] < 0.055


def test_an_axis_with_hardly_a_way_is_refused() -> None:
    rig = Virtual(stops=(-4.6e-4, 4.6e-4))
    on = stand(rig)
    found = Direction(1.0, 1.2, 1.2, 0.0, 0.0)
    with pytest.raises(CommissionError, match="counts only"):
        ends(on, found, FREE._replace(speed=0.02), 0.5)


@pytest.mark.parametrize("place", [0.05, -0.02])
def test_go_creeps_to_a_place(place: float) -> None:
    rig = Virtual()
    on = stand(rig)
    found = direction(on, FREE)
    rig.log.clear()
    assert go(on, place, found, FREE._replace(speed=0.02))
    assert on.position() == pytest.approx(place, abs=2e-3)
    assert abs(rig.v) < 1e-9


def test_go_says_when_it_is_held() -> None:
    rig = Virtual()
    on = stand(rig)
    found = direction(on, FREE)
    assert not go(on, 0.2, found, FREE._replace(speed=0.02))


def test_creep_takes_its_effort_away_when_too_fast() -> None:
    law = Creep(1.0, 0.01, 1.0, 1e-3)
    slow = [law(0.0, 0.001 * k, 0.0) for k in range(3)]
    assert slow == pytest.approx([0.0025, 0.005, 0.0075])
    assert law(0.0, 0.004, 0.015) == pytest.approx(0.0)
    law.effort = 0.9
    assert law(0.0, 0.005, 0.015) == pytest.approx(0.89)
    assert law(0.0, 0.006, 0.021) == 0.0
    back = Creep(-1.0, 0.01, 1.0, 1e-3, target=-1.0)
    assert back(0.0, 0.0, 0.0) == pytest.approx(-0.0025)
    assert back(0.0, -1.0, 0.0) is None


def test_creep_is_not_fooled_by_an_axis_that_rocks_within_a_count() -> None:
    """From count to count in a period, every ten: by its last periods it goes twice too fast."""
    efforts = {}
    for pitch in (0.0, 0.02):
        law = Creep(1.0, 0.5, 1.0, 1e-3, 9.0, PUSH, pitch)
        for k in range(600):
            there = k // 10 % 2
            law(k * 1e-3, 0.02 * there, 4.0 if there and k % 10 < 5 else 0.0)
        efforts[pitch] = law.effort
    assert efforts[0.0] < 0.5 and efforts[0.02] > 1.0
    # What goes two counts a period is too fast.
    for k in range(600, 800):
        law(k * 1e-3, 0.04 * (k - 600), 40.0)
    assert law.effort == 0.0


def test_a_ramp_goes_on_where_it_did_not_slide() -> None:
    ramp = Ramp(1.0, 1.0, 0.01, 5.0, 0.1)
    assert ramp(0.0, 0.0, 0.0) is not None
    ramp(0.001, 0.2, 0.0)
    assert ramp(0.002, 5.0, 0.0) is None and ramp.slid
    ramp.again(5.0, 2.0)
    assert not ramp.slid
    given = [ramp(0.003 + 0.001 * k, 5.0, 0.0) for k in range(3)]
    assert given == pytest.approx([2.01, 2.02, 2.03])
    assert ramp(1.0, 5.2, 0.0) == pytest.approx(2.03)  # a motion: it is held


def test_a_drive_ends_at_its_limits_without_effort() -> None:
    rig = Virtual()
    on = stand(rig)
    fast = on.drive(lambda t, x, v: 9.0, 1.0, Caution(5.0, 0.1))
    assert fast.ended == SPEED
    assert max(fast.u) == 5.0
    assert fast.u[-1] == 0.0
    on.rest(FREE)
    far = on.drive(lambda t, x, v: -9.0, 1.0, Caution(5.0, math.inf, low=-0.01))
    assert far.ended == WINDOW
    assert far.x[-1] < -0.01 <= far.x[-2]
    assert on.rest(FREE)
    rig.deaf = rig.t + 0.1
    assert on.drive(lambda t, x, v: 0.0, 1.0, FREE).ended == SENSOR
    assert not on.rest(FREE, 0.5)


def test_positions_count_from_where_it_began() -> None:
    rig = Virtual(Axis(0.1, 5.0))
    on = stand(rig)
    assert on.position() == 0.0
    rig.x = 0.0123
    on.rig.wait(rig.dt)
    assert on.position() == pytest.approx(0.0123, abs=1.1e-5)
