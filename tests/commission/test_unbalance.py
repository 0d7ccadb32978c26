"""An eccentric load that turns: what gravity takes is found and held, at any place."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission import _exciting, _gravity, axis, procedure, rotary
from macromicro.commission._probing import Direction, direction
from macromicro.commission.procedure import Options, Work
from macromicro.commission.running import Place, commission
from macromicro.commission.stand import Caution, CommissionError, Pull, Stand
from macromicro.identify import eccentric
from macromicro.place import ANGLE

FREE = Caution(10.0, math.inf)
DEG = math.pi / 180.0
PITCH = 2.0 * math.pi / 20_000
STOPS = (-2.0, 2.5)
SPEED, LIFTED, WINDOW = 0.5, 0.02, (-4.0, 4.0)
DISC = PLAIN._replace(stribeck_speed=0.2, viscous=0.5)
LIMITS = Options(8.0, 12.0, SPEED, 7.0)


def hung(most: float, angle: float) -> Pull:
    """Gravity that pulls so hard at a load that hangs there."""
    return Pull(most * math.cos(angle), -most * math.sin(angle))


def rig(most: float, angle: float, sign: float = 1.0, **other: float) -> Virtual:
    pull = hung(most, angle)
    load = DISC._replace(sine=pull.sine, cosine=pull.cosine, **other)
    return Virtual(load, dt=2e-3, pitch=PITCH, stops=STOPS, sign=sign)


def stand(made: Virtual) -> Stand:
    return Stand(session(made), made.dt, made.pitch, place=ANGLE)


def found(on: Stand) -> _gravity.Weight:
    return _gravity.balance(on, FREE, SPEED, LIFTED, WINDOW)


def test_gravity_seen_from_elsewhere_is_the_same() -> None:
    pull = Pull(0.7, -0.4)
    for x in np.linspace(-4.0, 4.0, 9):
        assert pull.seen_from(1.1).at(x - 1.1) == pytest.approx(pull.at(x))
    assert pull.along(np.array([0.3])) == pytest.approx([pull.at(0.3)])
    assert pull.times(-2.0).at(0.3) == pytest.approx(-2.0 * pull.at(0.3))
    assert pull.most == pytest.approx(math.hypot(0.7, 0.4))


# Where it hangs: below it, above it, far to a side, beyond either end, on which it leans then.
@pytest.mark.parametrize(
    ("angle", "sign"),
    [
        (0.0, 1.0),
        (180.0, -1.0),
        (-150.0, 1.0),
        pytest.param(80.0, -1.0, marks=pytest.mark.slow),
        pytest.param(160.0, 1.0, marks=pytest.mark.slow),
    ],
)
def test_gravity_is_found_and_held_wherever_it_hangs(angle: float, sign: float) -> None:
    made = rig(3.0, angle * DEG, sign)
    on = stand(made)
    held = found(on)
    # The encoder may count down; the effort at the D/A holds the same load.
    assert on.pull == held.pull and held.hold == on.hold == 0.0 and on.sign == 1.0
    true = hung(3.0, angle * DEG)
    assert (held.sine, held.cosine) == pytest.approx((sign * true.sine, true.cosine), abs=0.06)
    assert made.most <= FREE.effort
    # It stays where it is, and is as a balanced one.
    on.rest(FREE)
    place = made.x
    on.drive(lambda t, x, v: 0.0, 0.5, FREE)
    assert made.x == place
    shown = direction(on, FREE)
    assert shown.sign == sign
    assert shown.forward == pytest.approx(1.2, abs=0.1)
    assert shown.backward == pytest.approx(1.2, abs=0.1)


def test_a_load_that_leant_on_its_end_from_the_beginning_is_lifted_off_it() -> None:
    made = rig(3.0, -150.0 * DEG)
    made.x = STOPS[0]
    held = found(stand(made))
    true = hung(3.0, -150.0 * DEG)
    # Its angles count from where it leant.
    here = true.seen_from(STOPS[0])
    assert (held.sine, held.cosine) == pytest.approx((here.sine, here.cosine), abs=0.06)


def test_a_load_that_fell_on_an_elastic_end_is_brought_off_it() -> None:
    """Such an end gives both ways, as what turns freely does."""
    made = rig(3.0, -150.0 * DEG)
    made.stiff = 400.0
    held = found(stand(made))
    true = hung(3.0, -150.0 * DEG)
    assert (held.sine, held.cosine) == pytest.approx((true.sine, true.cosine), abs=0.06)
    assert STOPS[0] < made.x < STOPS[1]


def test_an_end_is_felt_on_its_side_and_none_elsewhere() -> None:
    made = rig(3.0, -150.0 * DEG)
    made.stiff, made.x = 400.0, STOPS[0] - 0.0045
    on, started = stand(made), Direction(1.0, 1.2, 1.2, 0.01, 0.0)
    on.rest(FREE)
    caution = FREE._replace(speed=SPEED)
    assert _gravity._end(on, started, caution, LIFTED) == -1.0
    made = rig(0.0, 0.0)
    assert _gravity._end(stand(made), started, caution, LIFTED) == 0.0
    assert abs(made.x) < LIFTED  # it is back about where it stood


def test_what_no_effort_brings_off_its_end_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    started, lifted = Direction(1.0, 1.2, 1.2, 0.01, 0.0), _gravity.Weight(2.0, 1.0)
    monkeypatch.setattr(_gravity, "direction", lambda *given: started)
    monkeypatch.setattr(_gravity, "_end", lambda *given: -1.0)
    on, asked = stand(rig(0.0, 0.0)), []
    on.sign, on.hold, on.pull = -1.0, 1.0, Pull(1.0, 1.0)

    def off(at: Stand, free: Caution, ends: Any, *rest: Any) -> _gravity.Weight | None:
        asked.append((at.sign, at.hold, at.pull, tuple(ends)))
        return lifted if len(asked) == 1 else None

    monkeypatch.setattr(_gravity, "_lift_off", off)
    assert _gravity._first_hold(on, FREE, SPEED, LIFTED) == (lifted, started)
    assert asked == [(1.0, 0.0, Pull(), (-1.0,))]
    with pytest.raises(CommissionError, match=r"stands at an end, and 10 V do not move it away"):
        _gravity._first_hold(on, FREE, SPEED, LIFTED)


def test_a_balanced_load_has_none_and_a_constant_torque_stays_one() -> None:
    on = stand(rig(0.0, 0.0))
    assert found(on) == _gravity.Weight(0.0, 0.0)
    assert (on.hold, on.pull) == (0.0, Pull())
    on = stand(rig(0.0, 0.0, offset=3.0))
    held = found(on)
    assert held.hold == on.hold == pytest.approx(3.0, abs=0.05)
    assert held.pull == on.pull == Pull()


def test_what_it_may_be_given_must_hold_its_load() -> None:
    with pytest.raises(CommissionError, match=r"up to 5.* V on its eccentric load.*Balance it, or"):
        _gravity.balance(stand(rig(6.0, 80.0 * DEG)), Caution(4.0, math.inf), 0.5, 0.02, WINDOW)


def test_a_torque_is_gravity_s_where_sine_and_cosine_explain_it() -> None:
    at = np.linspace(-1.5, 1.5, 9)
    true = Pull(0.5, -0.3)
    kept = _gravity.significant(at, true.along(at), 1.0)
    assert kept is not None and (kept.sine, kept.cosine) == pytest.approx((0.5, -0.3))
    assert kept.error == pytest.approx(0.03)  # of the friction, whose sides may differ
    assert _gravity.significant(at, np.full(9, 0.5), 1.0) is None
    assert _gravity.significant(at, 0.02 * np.sin(at), 1.0) is None  # beside the friction nothing
    scatter = np.array([0.5, -0.5, 0.5, -0.5, 0.5, -0.5, 0.5, -0.5, 0.5])
    assert _gravity.significant(at, 0.2 * np.sin(at) + scatter, 1.0) is None
    assert _gravity.significant(at[:3], np.sin(at[:3]), 1.0) is None


@pytest.mark.slow
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_eccentric_load_is_commissioned(sign: float, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_exciting, "STROKES", 4)
    angle = 70.0 * DEG
    made = rig(2.5, angle, sign)
    work = Work(stand(made), LIMITS)
    procedure.perform(rotary.KIND, work, lambda step, intent: None, lambda step, found: None)
    made_of = axis.fit(work)
    told = rotary.estimates(made_of)
    assert told["unbalance"].value == pytest.approx(2.5, abs=told["unbalance"].half + 0.01)
    # In counts: where they fall it hangs at the other side.
    low = axis.ends_of(work).low
    off = math.remainder(told["hangs"].value - (sign * angle - low), 2.0 * math.pi)
    assert abs(off) < told["hangs"].half + 0.005
    assert told["mass"].value == pytest.approx(DISC.mass, rel=0.02)
    assert "sine" not in told and told["unbalance"].unit == "V" and told["hangs"].unit == "rad"
    assert made.most <= LIMITS.effort
    # The machine counts from where it is brought, a little above the low end.
    home = axis.home(work, made_of)
    settings = rotary.settings(work, made_of, home)
    hangs = float(settings["load.hangs"].strip('"').split()[0])
    assert math.remainder(hangs + home.low - sign * angle, 2.0 * math.pi) == pytest.approx(
        0.0, abs=0.02
    )
    assert float(settings["load.unbalance"].strip('"').split()[0]) == pytest.approx(2.5, abs=0.05)
    assert any("falls when the drive is off" in one for one in rotary.doubts(work, made_of))


def place() -> Place:
    return Place("a disc", lambda seed: rig(2.5, 1.2), 2e-3, PITCH, 8.0, False, rotary.KIND)


@pytest.mark.slow
def test_it_is_resumed_with_its_load_found_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(_exciting, "STROKES", 4)
    said: list[str] = []

    def until(title: str) -> None:
        def ended() -> bool:
            return title in said

        with pytest.raises(KeyboardInterrupt):
            commission(
                place(), LIMITS, tmp_path, ask=lambda title, _: said.append(title), ended=ended
            )

    until("chirp for modes")
    assert said[0] == "gravity" and (tmp_path / "strokes.h5").exists()
    said.clear()
    until("chirp for modes")
    assert said == ["gravity", "end stops and travel", "chirp for modes"]


def test_strokes_of_a_window_that_was_named_are_made_again() -> None:
    work = Work(stand(rig(2.5, 1.2)), LIMITS._replace(low=-1.0, high=1.0))
    work.found |= {
        axis.WEIGHT: _gravity.Weight(0.0, 1.0, 1.0, 0.5),
        axis.ENDS: axis.Ends(-1.0, 1.0, False),
        axis.STROKES: [],
    }
    rotary.KIND.prepare(work)
    assert axis.STROKES not in work.found and work.stand.pull == Pull()
    work.found |= {axis.ENDS: axis.Ends(-1.0, 1.0, True), axis.STROKES: []}
    rotary.KIND.prepare(work)
    assert axis.STROKES in work.found
    assert tuple(rotary.MEANINGS) == eccentric.NAMES
