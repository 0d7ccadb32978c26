"""A weight that nothing holds: lifted, held and measured, or said why not."""

from __future__ import annotations

import math

import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission import _exciting, _gravity, axis, procedure
from macromicro.commission._probing import direction
from macromicro.commission.procedure import Options, Work
from macromicro.commission.stand import Caution, CommissionError, Stand

FREE = Caution(10.0, math.inf)
SPEED = 0.04
HEAVY = PLAIN._replace(offset=3.0)


def stand(rig: Virtual) -> Stand:
    return Stand(session(rig), rig.dt, rig.pitch)


def test_an_axis_that_stays_has_no_weight() -> None:
    rig = Virtual()
    on = stand(rig)
    assert _gravity.find_weight(on, FREE, SPEED, 1e-3) == _gravity.Weight(0.0, 0.0)
    assert on.hold == rig.most == 0.0


@pytest.mark.parametrize(("sign", "down"), [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)])
def test_a_weight_is_lifted_held_and_measured(sign: float, down: float) -> None:
    rig = Virtual(HEAVY._replace(offset=3.0 * down), sign=sign)
    on = stand(rig)
    found = _gravity.find_weight(on, FREE, SPEED, 1e-3)
    # The encoder's sign changes nothing: the hold is an effort at the D/A.
    assert found.hold == on.hold == pytest.approx(3.0 * down, abs=0.05)
    assert found.breakaway == pytest.approx(1.2, abs=0.05)
    # It stands, off its end.
    on.drive(lambda t, x, v: 0.0, 0.5, FREE)
    place = rig.x
    assert rig.effort == on.hold
    on.drive(lambda t, x, v: 0.0, 0.5, FREE)
    assert rig.x == place
    assert abs(rig.x - rig.stops[0 if down > 0.0 else 1]) > 20.0 * rig.pitch
    shown = direction(on, FREE)
    assert shown.sign == sign
    assert shown.forward == pytest.approx(1.2, abs=0.06)
    assert shown.backward == pytest.approx(1.2, abs=0.06)


@pytest.mark.parametrize(
    ("rig", "most", "words"),
    [
        (Virtual(HEAVY), 3.5, "do not lift"),
        (Virtual(HEAVY, stops=(-1e6, 1.0)), 10.0, "still does after"),
        (Virtual(HEAVY, deaf=0.1), 10.0, "sensor gives no value"),
    ],
)
def test_what_cannot_be_held_is_said(rig: Virtual, most: float, words: str) -> None:
    with pytest.raises(CommissionError, match=words):
        _gravity.find_weight(stand(rig), Caution(most, math.inf), SPEED, 1e-3)
    assert rig.effort == 0.0
    assert rig.most <= most


def test_efforts_above_a_hold_stay_within_the_largest() -> None:
    rig = Virtual(PLAIN._replace(coulomb=50.0))
    on = stand(rig)
    on.hold, on.sign = 3.0, -1.0
    record = on.drive(lambda t, x, v: 100.0 if t < 0.01 else -100.0, 0.02, Caution(8.0, math.inf))
    # What is recorded is what was given beside the hold, in the direction of the counts.
    assert record.u[0] == 8.0 + 3.0
    assert record.u[-1] == -8.0 + 3.0
    assert rig.log[0] == -8.0 and rig.log[-2] == 8.0
    assert rig.effort == 3.0


@pytest.mark.slow
def test_an_axis_with_a_weight_is_commissioned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_exciting, "STROKES", 4)
    rig = Virtual(HEAVY, dt=2e-3, late=1, ripple=0.02, sign=-1.0)
    work = Work(Stand(session(rig), rig.dt, rig.pitch), Options(8.0, 1.0, SPEED, 0.3))
    procedure.perform(axis.KIND, work, lambda step, intent: None, lambda step, found: None)
    found = axis.fit(work)
    # Counts fall while it rises, and the weight pulls towards higher counts.
    assert found.whole.offset == pytest.approx(-3.0, abs=0.05)
    assert found.axis.mass == pytest.approx(PLAIN.mass, rel=0.03)
    assert axis.KIND.estimates(found)["offset"].value == found.whole.offset
    assert rig.most <= 8.0
    settings = axis.settings(work, found, None)
    assert settings["load.incline"].startswith('"-')
    assert any("sinks" in doubt for doubt in axis.KIND.doubts(work, found))
    # Another session holds it again before it moves.
    again = Work(Stand(session(rig), rig.dt, rig.pitch), work.options, dict(work.found))
    axis.KIND.prepare(again)
    assert (again.stand.hold, again.stand.sign) == (work.stand.hold, -1.0)
