"""What a user set stays set: derived values and those that are only equal to them."""

from pathlib import Path

import pytest

from macromicro import Settings
from macromicro.errors import InputError
from macromicro.machines import compositions, doubts
from macromicro.machines import machine as machines
from macromicro.machines.joint.settings import DEFAULT as XY
from macromicro.schema import config
from macromicro.schema.par import Given, changed, is_given, value_at

AXIS = machines.MACHINES[0].settings
SCALE = {"amplifier.full_scale": "5 V"}


@pytest.mark.parametrize("first", [True, False])
def test_an_effort_that_was_set_to_the_derived_value_is_not_changed_by_another_scale(first):
    assert AXIS.guard.effort == AXIS.amplifier.full_scale == 10.0
    assert AXIS.with_(SCALE).guard.effort == 5.0
    with pytest.raises(InputError, match=r"guard.effort.*at most amplifier.full_scale \(5 V\)"):
        if first:
            AXIS.with_("guard.effort", "10 V").with_(SCALE)
        else:
            AXIS.with_({"guard.effort": "10 V", **SCALE})


def test_a_value_of_one_axis_of_a_plane_is_kept_for_that_axis_alone():
    given = changed(XY, {"x.arrival.tolerance": XY.x.arrival.tolerance})
    assert is_given(given, "x.arrival.tolerance") and not is_given(given, "y.arrival.tolerance")
    coarse = {"x.encoder.pitch": "40 um", "y.encoder.pitch": "40 um"}
    assert given.with_(coarse).x.arrival.tolerance == XY.x.arrival.tolerance
    assert given.with_(coarse).y.arrival.tolerance > XY.y.arrival.tolerance


def test_the_two_stage_machine_keeps_what_was_set_too():
    usual = Settings().controller.motor_limit
    given = changed(Settings(), {"controller.motor_limit": usual})
    assert Settings().with_("guard.motor", "4 V").controller.motor_limit == 4.0 != usual
    with pytest.raises(InputError, match=r"controller.motor_limit: '5 V'; .* guard.motor \(4 V\)"):
        given.with_("guard.motor", "4 V")


def test_a_written_file_keeps_what_was_set(tmp_path: Path):
    given = AXIS.with_("guard.effort", "10 V")
    file = tmp_path / "axis.toml"
    text = config.changed_toml(given, AXIS)
    file.write_text(f'machine = "axis"\n{text}')
    assert "effort" in text
    _, read = compositions.load(file)
    assert is_given(read, "guard.effort") and read == given


def test_settings_are_equal_by_their_values():
    given = AXIS.with_("guard.effort", "10 V")
    assert given == AXIS and hash(given) == hash(AXIS) and given.given == Given()
    assert not config.difference(given, AXIS)


def test_a_value_that_was_set_is_not_in_doubt():
    tree = AXIS.with_("drive.frequency", "20 Hz").with_("drive.damping", 0.01)
    paths = [each.path for each in doubts.find_doubts(tree)]
    assert paths
    given = changed(tree, {path: value_at(tree, path) for path in paths})
    assert given == tree and not doubts.find_doubts(given)
