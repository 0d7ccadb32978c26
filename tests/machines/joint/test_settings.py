"""Two axes in one file: what follows from what, and what cannot work together."""

import math

import pytest

from macromicro.errors import InputError
from macromicro.machines import axis, compositions, machine
from macromicro.machines.joint.machine import XY_MACHINE
from macromicro.machines.joint.settings import AXES, DEFAULT, RULES, of
from macromicro.schema import config
from macromicro.schema.par import value_at


def file(folder, text):
    place = folder / "xy.toml"
    place.write_text(text, encoding="utf-8")
    return place


def test_the_lower_axis_carries_the_upper_one():
    tree = DEFAULT.with_({"y.load.mass": "0.7 kg", "y.load.payload": "2 kg", "stack.body": "3 kg"})
    assert tree.x.load.payload == pytest.approx(5.7)
    assert tree.x.motion.acceleration < DEFAULT.x.motion.acceleration
    assert DEFAULT.with_("stack.carries", "nothing").x.load.payload == 0.0
    by_hand = DEFAULT.with_("x.load.payload", "9 kg")
    assert by_hand.with_("stack.body", "2 kg").x.load.payload == 9.0


def test_each_axis_is_what_it_is_alone():
    for name, own in zip(AXES, of(DEFAULT), strict=True):
        alone = axis.DEFAULT.with_(
            {"load.payload": f"{own.load.payload} kg", "load.stop_high": f"{own.load.stop_high} m"}
        )
        assert own == alone, name


def test_the_limits_of_the_path_are_those_of_both_axes():
    x, y = of(DEFAULT)
    assert DEFAULT.path.speed == pytest.approx(
        math.hypot(x.motion.velocity, y.motion.velocity), rel=1e-3
    )
    finer = DEFAULT.with_({"x.arrival.tolerance": "60 um", "y.arrival.tolerance": "80 um"})
    assert finer.path.tolerance == pytest.approx(1e-4)


def test_no_rule_depends_on_a_later_one():
    tree = DEFAULT.with_({"y.load.payload": "1 kg", "x.amplifier.supply": "20 V"})
    for path, rule in RULES:
        assert value_at(tree, path) == type(value_at(tree, path))(rule(tree)), path


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ('[y.timing]\nperiod = "0.5 ms"', r"y.timing.period: '0.5 ms'; accepted: x.timing.period"),
        ('[x.load]\npayload = "0.4 kg"', r"x.load.payload: '0.4 kg'; accepted: 0.5 kg or more"),
        ('[path]\ntolerance = "1 um"', r"path.tolerance: '1 um'; accepted: 12.57 um or more"),
        ('[y.load]\nincline = "90 deg"\npayload = "20 kg"', r"y.friction.coulomb"),
        ('[x.lod]\nmass = "1 kg"', r"x.lod.*unknown key"),
        ('[z.load]\nmass = "1 kg"', r"z.*unknown key"),
        ('[stack]\ncarries = "x"', r"stack.carries: 'x'; accepted: 'y' or 'nothing'"),
        ('[hidden]\nsquareness = "20 deg"', r"hidden.squareness"),
    ],
)
def test_what_cannot_work_is_refused(tmp_path, text, what):
    with pytest.raises(InputError, match=what):
        compositions.load(file(tmp_path, f'machine = "xy"\n{text}\n'))


def test_side_by_side_no_payload_is_asked_for(tmp_path):
    text = 'machine = "xy"\n[stack]\ncarries = "nothing"\n[x.load]\npayload = "0.1 kg"\n'
    assert compositions.load(file(tmp_path, text))[1].x.load.payload == 0.1


def test_all_settings_as_toml_are_read_back_bit_for_bit(tmp_path):
    tree = DEFAULT.with_({"y.load.payload": "0.123456789 kg", "hidden.squareness": "0.01 deg"})
    text = machine.as_toml(XY_MACHINE, tree)
    assert text.startswith('machine = "xy"\n')
    found, again = compositions.load(file(tmp_path, text))
    assert again == tree and found.name == "xy"
    assert machine.as_toml(XY_MACHINE, tree, "path").startswith("[path]\n")


def test_each_axis_may_have_a_law_of_its_own(tmp_path):
    text = 'machine = "xy"\n[y]\nlaw = "tests.control.own_laws:sliding"\n[y.own]\nslope = "9 1/s"\n'
    found, tree = compositions.load(file(tmp_path, text))
    assert tree.y.own.slope == 9.0 and tree.x.law == "cascade"
    assert [one.law.name == "cascade" for _, one in found.stages] == [True, False]
    assert compositions.load(file(tmp_path, machine.as_toml(XY_MACHINE, tree)))[1] == tree


def test_one_axis_alone_is_a_file_of_the_machine_axis(tmp_path):
    tree = DEFAULT.with_("y.load.payload", "2 kg")
    for own in of(tree):
        found, alone = machine.load(file(tmp_path, machine.as_toml(XY_MACHINE.stages[0][1], own)))
        assert found.name == "axis" and alone == own


def test_who_knows_one_stage_says_how_to_get_one(tmp_path):
    path = file(tmp_path, 'machine = "xy"\n')
    with pytest.raises(InputError, match=r"single-stage.*config show --config FILE --axis x"):
        machine.chosen(path)
    with pytest.raises(InputError, match="two_stage, xy, axis"):
        machine.named("xyz", "test")
    config.check(DEFAULT, "the defaults")
