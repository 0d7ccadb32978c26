"""In what a bench may differ from every model (docs/validation/beyond.md); off by default."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro.plant import amplifier, belt, bench, carriage, friction, hall, laser, thermal
from macromicro.plant import micro as stage
from macromicro.plant.bench import Noise
from macromicro.plant.friction import Friction, Worn
from macromicro.plant.micro import MicroState
from macromicro.settings import Settings
from macromicro.types import Outputs
from macromicro.uncertainty.table import VARIANTS

from .drives import MACRO, MICRO

P, HEAT = Friction(), MICRO.thermal


def test_the_default_bench_has_none_of_them() -> None:
    """The middle of what `robust --variants` draws is within its range."""
    entries = Settings()
    for each in VARIANTS:
        ((path, weight),) = each.parts
        node: object = entries
        for name in path.split("."):
            node = getattr(node, name)
        assert node == 0.0 and weight == 1.0 and each.low <= 0.0 <= each.high


def test_friction_differs_along_the_travelled_way() -> None:
    """Not along the rod: the same place again has another friction."""
    p = P._replace(ripple=0.0, random=0.3, random_length=2e-3)
    ways = np.arange(0.0, 4.0, 1e-3)
    level = np.array([friction.local(p, 0.1, Worn(float(w), 0.0)) for w in ways])
    assert level.std() == pytest.approx(0.3 * math.sqrt(26.0 / 35.0), rel=0.06)
    assert np.abs(np.diff(level)).max() < 0.3 * 2.0 * math.sqrt(3.0) * 0.8
    other = friction.local(p._replace(random_seed=1.0), 0.1, Worn(3e-3, 0.0))
    assert other != friction.local(p, 0.1, Worn(3e-3, 0.0))


def test_the_ripple_moves_with_the_travelled_way() -> None:
    p = P._replace(ripple_shift=0.1)
    found = friction.local(p, 0.03, Worn(0.2, 0.0))
    assert found == pytest.approx(friction.ripple(P, 0.05), rel=1e-12)


def test_breakaway_rises_with_the_logarithm_of_the_rest() -> None:
    p = P._replace(ripple=0.0, ageing=0.4)
    rise = [friction.local(p, 0.0, Worn(0.0, rest)) for rest in (0.0, 9.0, 99.0)]
    assert rise == pytest.approx([0.0, 0.4, 0.8], abs=1e-12)


@given(st.floats(0.0, 100.0), st.floats(-0.5, 0.5), st.floats(1e-5, 1e-2))
def test_rest_grows_while_it_stands_and_slip_ends_it(rest: float, v: float, dt: float) -> None:
    """Dieterich's law: at a steady speed the rest becomes slip / |v|."""
    new = friction.worn(P, Worn(1.0, rest), v, dt)
    assert new.way == pytest.approx(1.0 + abs(v) * dt, rel=1e-12)
    # Backward Euler of d rest/dt = 1 - |v| rest / slip
    assert new.rest - rest == pytest.approx(
        dt * (1.0 - abs(v) * new.rest / P.ageing_slip), abs=1e-9 * (1.0 + rest)
    )


def test_the_carriage_keeps_what_its_friction_remembers() -> None:
    """It stands: the rest grows; it travels: the way does, and the rest is forgotten."""
    p = MACRO
    s = carriage.at_rest(0.1)
    for _ in range(50):
        s = carriage.advance(p, s, 0.0, 1e-3, 20)
    assert s.worn.rest == pytest.approx(0.05, rel=0.02) and s.worn.way < 1e-6
    x = s.x
    for _ in range(200):
        s = carriage.advance(p, s, 18.0, 1e-3, 20)
    assert s.worn.way == pytest.approx(s.x - x, rel=0.02)
    assert s.worn.rest == pytest.approx(P.ageing_slip / s.v, rel=0.1)


def test_an_aged_carriage_breaks_away_later() -> None:
    aged = MACRO._replace(friction=MACRO.friction._replace(ageing=0.5))

    def started(rest: float) -> int:
        s = carriage.at_rest(0.1)._replace(worn=Worn(0.0, rest))
        for k in range(2000):
            s = carriage.advance(aged, s, 11.0 + 0.002 * k, 1e-3, 5)
            if s.x > 0.1 + 1e-4:
                return k
        return 2000

    assert started(999.0) > started(0.0) + 50


def test_the_belts_frequency_follows_the_place() -> None:
    p = MACRO.belt._replace(slope=0.8)
    found = [belt.tensioned(p, x).frequency / p.frequency for x in (0.0, 0.1, 0.2)]
    assert found == pytest.approx([0.92, 1.0, 1.08])
    assert belt.tensioned(p, 0.2)[1:] == p[1:]
    s = carriage.at_rest(0.2)._replace(q=1e-5)
    sliding = MACRO._replace(belt=p)
    new = carriage.substep(sliding, s, 0.0, 0.0, 1e-4)
    assert (new.q, new.qv) == belt.step(belt.tensioned(p, 0.2), 1e-5, 0.0, new.v, 1e-4)
    fixed = carriage.substep(MACRO._replace(belt=belt.tensioned(p, 0.2)._replace(slope=0.0)),
                             s, 0.0, 0.0, 1e-4)  # fmt: skip
    assert (new.v, new.q) == (fixed.v, fixed.q)


def test_the_supply_sags_under_its_current() -> None:
    """At half duty it gives half the motor's current, and half of what it loses is seen."""
    p = Settings().bench.amplifier._replace(sag=0.6)
    assert amplifier.motor_volts(p, 2.5, 0.8) == pytest.approx(0.5 * (20.0 - 0.6 * 0.5 * 0.8))
    assert amplifier.motor_volts(p, -2.5, -0.8) == pytest.approx(-0.5 * (20.0 - 0.6 * 0.5 * 0.8))


def test_a_tilted_beam_shows_the_cosine() -> None:
    p = Settings().sensors.laser._replace(tilt=0.01, noise=0.0)
    assert laser.reading(p, 0.2, 0.0, 0.0) == pytest.approx(0.2 * (1.0 - 5e-5), abs=1e-8)


def test_a_warm_hall_sensor_drifts() -> None:
    p = Settings().sensors.hall._replace(null_drift=4e-4, gain_drift=-1e-3)
    cold = hall.volts(p, 1e-3, 0.0) - p.null
    assert hall.volts(p, 1e-3, 10.0) == pytest.approx(p.null + 4e-3 + 0.99 * cold, abs=1e-12)


def test_the_bench_warms_its_hall_sensor_with_the_body() -> None:
    tree = Settings().with_({"sensors.hall.null_drift": "0.4 mV/K", "sensors.hall.lag": "0 s"})
    p = bench.prepare(tree.bench, tree.sensors)
    s = bench.initial(p)
    s = s._replace(micro=s.micro._replace(body=35.0))
    new = bench.advance(p, s, Outputs(0.0, 0.0, 0.0, 0.0), Noise(), 1e-3)
    warm = new.micro.body - p.micro.thermal.ambient
    assert new.hall == pytest.approx(hall.volts(p.hall, 0.0, 0.0) + 4e-4 * warm, abs=1e-9)


def test_heat_transfer_grows_with_the_temperature() -> None:
    """About what `wire_resistance` says of wires 40 K above the plates."""
    p = HEAT._replace(convection=0.004)
    plain = [thermal.to_plates(HEAT, 30.0 + d, 30.0) for d in (20.0, 40.0, 80.0)]
    found = [thermal.to_plates(p, 30.0 + d, 30.0) for d in (20.0, 40.0, 80.0)]
    assert found == pytest.approx([0.92 * plain[0], plain[1], 1.16 * plain[2]])
    assert thermal.to_plates(p, 20.0, 100.0) == -thermal.to_plates(p, 100.0, 20.0)
    steep = HEAT._replace(convection=0.02)
    assert thermal.to_plates(steep, 30.0, 30.0) == 0.0
    assert thermal.to_plates(steep._replace(convection=0.025), 31.0, 30.0) > 0.0


def test_a_draught_comes_and_goes() -> None:
    """It changes what the air takes, not what the plates do."""
    p = HEAT._replace(draught=0.2, draught_time=2.0)
    air = np.array([thermal.airy(p, t) for t in np.arange(0.0, 4000.0, 0.5)])
    assert air.mean() == pytest.approx(1.0, abs=0.01) and air.min() > 0.6
    assert air.std() == pytest.approx(0.2 * math.sqrt(26.0 / 35.0), rel=0.05)
    still, moved = (thermal.flows(HEAT, 80.0, 40.0, 35.0, 0.0, a) for a in (1.0, 1.3))
    assert moved[0] == still[0]
    assert moved[1:] == pytest.approx((1.3 * still[1], 1.3 * still[2]))
    assert thermal.airy(p._replace(draught=5.0), 7.7) >= 0.1


def _heated(p: stage.Micro, periods: int, ctrl: float, s: MicroState | None = None) -> MicroState:
    s = stage.cold(p, 25.0) if s is None else s
    for _ in range(periods):
        s = stage.advance(p, s, ctrl, 0.0, 0.0, 1e-3)
    return s


def _micro(**changed: str) -> stage.Micro:
    tree = Settings().with_({f"bench.{k.replace('__', '.')}": v for k, v in changed.items()})
    return bench.prepare(tree.bench, tree.sensors).micro


def test_the_draught_is_that_of_the_stages_own_time() -> None:
    p = _micro(thermal__draught="0.2")
    s = _heated(p, 1, 0.0)._replace(body=40.0, t=7.0)
    new = stage.advance(p, s, 0.0, 0.0, 0.0, 1e-3)
    _, _, out = thermal.flows(p.thermal, s.wire.temperature, s.plates, 40.0, 0.0,
                              thermal.airy(p.thermal, 7.0))  # fmt: skip
    into = (s.plates - 40.0) / p.thermal.plate_resistance * thermal.airy(p.thermal, 7.0)
    assert p.thermal.body_capacity * (new.body - 40.0) / 1e-3 == pytest.approx(into - out, rel=1e-9)
    assert new.t == 7.001


def test_creep_follows_the_contraction_and_returns_slowly() -> None:
    """0.01 a decade: a step's contraction grows by so much of it from 1 s to 10 s."""
    p = _micro(wire__creep="0.01")
    plain = _micro()
    s, base = _heated(p, 700, 1.9), _heated(plain, 700, 1.9)
    late, now = [], []
    for k in range(10_001):
        if k in (1000, 10_000):
            late.append(s.wire.x)
            now.append(base.wire.x)
        s = stage.advance(p, s, 1.56, 0.0, 0.0, 1e-3)
        base = stage.advance(plain, base, 1.56, 0.0, 0.0, 1e-3)
    extra = [a - b for a, b in zip(late, now, strict=True)]
    assert 0.004 * now[1] < extra[1] - extra[0] < 0.016 * now[1]
    assert s.wire.austenite == base.wire.austenite  # creep is no transformation
    stopped = s._replace(lags=s.lags + 1.0)
    assert stage.advance(p, stopped, 1.56, 0.0, 0.0, 1e-3).wire.x == p.wire.stop


def test_unequal_wires_keep_the_heat_and_part_in_temperature() -> None:
    """Without a loss to the air, all heat is in wires, plates and body; the half that sheds more is
    the colder one; halves that are equal are the wires as one."""
    p = _micro(wire__unequal="0.1")
    s = _heated(p, 1500, 1.56)
    assert s.wire.temperature < s.other.temperature - 1.0
    assert s.wire.austenite != s.other.austenite
    again = s._replace(wire=s.wire, other=s.other)
    content = 0.5 * p.thermal.wire_capacity * (again.wire.content + again.other.content)
    new = stage.advance(p, s, 1.56, 0.0, 0.0, 1e-3)
    after = 0.5 * p.thermal.wire_capacity * (new.wire.content + new.other.content)
    given_to = new.flow  # of the step's beginning, W
    assert (after - content) / 1e-3 == pytest.approx(
        0.5 * (s.power + new.power) - given_to, rel=1e-6
    )
    assert new.wire.x == pytest.approx(
        0.5 * p.wire.stroke * (new.wire.austenite + new.other.austenite), rel=0.02
    )
    hardly = _heated(_micro(wire__unequal="1e-9"), 800, 1.56)
    one = _heated(_micro(), 800, 1.56)
    assert hardly.wire.x == pytest.approx(one.wire.x, rel=2e-3)
    assert hardly.plates == pytest.approx(one.plates, rel=1e-3)


def test_unequal_wires_share_their_load() -> None:
    """The spring pulls by the mean of both contractions: where the other half contracts more, this
    half is pulled harder than by its own, and its thresholds rise (Clausius-Clapeyron)."""
    p = _micro(wire__unequal="0.1")
    s = _heated(p, 600, 1.56)
    ahead = s.other._replace(austenite=s.other.austenite + 0.2)
    a, b, _ = stage._halves(p, s, 2e-4, 2e-4, 0.0)
    pulled, eased, _ = stage._halves(p, s._replace(other=ahead), 2e-4, 2e-4, 0.0)
    force = 0.5 * p.load.rate * p.wire.stroke * 0.2
    assert force > 1e-3
    assert pulled.u < a.u - 0.1 * p.wire.shift * force
    assert eased.u > b.u + 0.1 * p.wire.shift * force
