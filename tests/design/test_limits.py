"""The quickest way of the carriage: against closed forms, and nothing quicker is found."""

import math

import pytest

from macromicro.design import limits
from macromicro.errors import InputError
from macromicro.settings import Settings

S = Settings()


def test_it_ends_at_the_distance_and_the_time_is_within_a_count():
    for way in (0.2, 0.05, 0.002):
        found = limits.quickest(S.bench, S.sensors, way)
        assert abs(found.off) < 1e-6
        assert found.distance == way


def test_without_friction_drag_and_lag_it_is_bang_bang_in_closed_form():
    """A mass under +-F over a way s takes 2 sqrt(s m / F), and a period until the effort acts."""
    b = S.bench
    easy = b._replace(
        friction=b.friction._replace(
            coulomb=0.0, stribeck=0.0, ripple=0.0, viscous=0.0, bristle=1e-6, bristle_damping=0.0
        ),
        motor=b.motor._replace(constant=1e-3, resistance=1.0, pulley=1e-3, inductance=1e-6),
        belt=b.belt._replace(participation=0.0),
        carriage=b.carriage._replace(mass=10.0),
    )
    force = 1e-3 / (1.0 * 1e-3) * 20.0
    drag = 1e-3**2 / (1.0 * 1e-3**2)  # of the back-EMF, N s/m
    way = 0.05
    found = limits.quickest(easy, S.sensors, way)
    ideal = 2.0 * math.sqrt(way * 10.0 / force)
    last = math.sqrt(2.0 * S.sensors.encoder.pitch * 10.0 / force)  # s, for the last count
    assert found.time == pytest.approx(ideal - last + 1e-3, abs=3e-3 + 0.1 * drag / 10.0 * ideal**2)


def test_more_friction_and_less_voltage_take_longer():
    base = limits.quickest(S.bench, S.sensors, 0.1).time
    b = S.bench
    rough = b._replace(friction=b.friction._replace(coulomb=1.2 * b.friction.coulomb))
    weak = b._replace(amplifier=b.amplifier._replace(supply=18.0))
    assert limits.quickest(rough, S.sensors, 0.1).time > base
    assert limits.quickest(weak, S.sensors, 0.1).time > base


@pytest.mark.parametrize("way", [0.0, -0.1, math.nan])
def test_a_distance_is_above_zero(way):
    with pytest.raises(InputError, match="above zero"):
        limits.quickest(S.bench, S.sensors, way)
