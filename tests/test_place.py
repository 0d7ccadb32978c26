"""What a stage that turns calls its quantities: degrees for millimetres, N*m for N."""

import math
from typing import Annotated, NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro import place, units
from macromicro.columns import Quantity, layout, quantities
from macromicro.place import ANGLE, LENGTH
from macromicro.schema.par import Par, entries


@pytest.mark.parametrize(
    ("slides", "turns"),
    [
        ("m", "rad"),
        ("mm", "deg"),
        ("um", "mdeg"),
        ("nm", "udeg"),
        ("m/s", "rad/s"),
        ("m/s^2", "rad/s^2"),
        ("N", "N*m"),
        ("N*s/m", "N*m*s/rad"),
        ("N/mm", "N*m/deg"),
        ("kg", "kg*m^2"),
        ("V*s^2/m", "V*s^2/rad"),
        ("V/(m*s)", "V/(rad*s)"),
        ("1/s", "1/s"),
        ("ms", "ms"),
        ("V", "V"),
        ("counts/s", "counts/s"),
    ],
)
def test_units_of_a_slide_become_those_of_what_turns(slides, turns):
    assert ANGLE.named(slides) == turns
    assert LENGTH.named(slides) == slides
    units.size(turns)  # there is such a unit


@given(st.floats(-1e3, 1e3))
def test_a_column_has_the_same_value_in_its_new_unit(value):
    for unit, scale in (("mm", 1e3), ("mm/s", 1e3), ("um", 1e6), ("m/s^2", 1.0), ("V", 1.0)):
        made = ANGLE.column(Quantity(unit, "meaning", scale=scale))
        # The field is in rad where it was in m: as much of the unit as of its base.
        assert made.scale * value * units.size(made.unit) == pytest.approx(
            scale * value * units.size(unit), rel=1e-14
        )
        assert LENGTH.column(Quantity(unit, "meaning", scale=scale)).scale == scale


def test_a_radian_is_recorded_in_degrees():
    class Row(NamedTuple):
        place: Annotated[float, Quantity("mm", "where", scale=1e3)]
        volts: Annotated[float, Quantity("V", "how much")]

    turns = layout(Row, place=ANGLE)
    assert [c.unit for c in turns.columns] == ["deg", "V"]
    assert turns.parts[0].scales == pytest.approx([math.degrees(1.0), 1.0], rel=1e-15)
    assert quantities(Row, ANGLE)["place"].column == "place"
    assert [c.unit for c in layout(Row).columns] == ["mm", "V"]


def test_people_read_degrees_and_millimetres():
    assert ANGLE.told(math.pi) == "180 deg"
    assert ANGLE.told(math.pi / 4, "m/s", 4) == "45 deg/s"
    assert ANGLE.told(2.5, "N") == "2.5 N*m"
    assert LENGTH.told(0.0125) == "12.5 mm"
    assert LENGTH.told(0.5, "m/s") == "0.5 m/s"
    assert ANGLE.fines == pytest.approx(1e3 * math.degrees(1.0)) and LENGTH.fines == 1e6
    assert LENGTH.smallest == 1e-6
    assert ANGLE.smallest == pytest.approx(math.radians(1e-3))


class Slide(NamedTuple):
    high: Annotated[float, Par("m", "highest", shown="mm", positive=True)] = 0.1
    speed: Annotated[float, Par("m/s", "speed", lo=0.5, hi=2.0)] = 1.0
    pull: Annotated[float, Par("N", "pull")] = 2.0
    drag: Annotated[float, Par("N*s/m", "drag")] = 2.0
    slow: Annotated[float, Par("m/s", "slow", shown="mm/s")] = 0.01
    time: Annotated[float, Par("s", "time", shown="ms")] = 0.5


@place.as_rotary
class Turn(Slide):
    __slots__ = ()


def test_a_set_is_turned_with_its_bounds_and_stays_the_same_tuple():
    pars = {e.path: e.par for e in entries(Turn())}
    read = {name: (par.unit, par.read_in) for name, par in pars.items()}
    assert read == {
        "high": ("rad", "deg"),
        "speed": ("rad/s", "deg/s"),
        "pull": ("N*m", "N*m"),
        "drag": ("N*m*s/rad", "N*m*s/rad"),
        "slow": ("rad/s", "deg/s"),
        "time": ("s", "ms"),
    }
    assert pars["high"].positive and (pars["speed"].lo, pars["speed"].hi) == (0.5, 2.0)
    assert [e.par.unit for e in entries(Slide())] == ["m", "m/s", "N", "N*s/m", "m/s", "s"]
    assert Turn() == Slide() and type(Turn()._replace(high=1.0)) is Turn


def test_settings_say_what_their_places_are():
    class Tree(NamedTuple):
        travel: Slide = Slide()

    assert place.of(Tree()) is LENGTH
    assert place.of(Tree(Turn())) is ANGLE
