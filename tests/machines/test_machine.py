"""Which machine a settings file is for, and its settings."""

import pytest

from macromicro.errors import InputError
from macromicro.machines import machine
from macromicro.machines.axis import DEFAULT
from macromicro.schema import config
from macromicro.settings import Settings


def file(folder, text):
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_names_its_machine(tmp_path):
    assert machine.chosen(file(tmp_path, 'machine = "axis"\n')).name == "axis"
    assert machine.chosen(file(tmp_path, 'machine = "two_stage"\n')) is None
    assert machine.chosen(file(tmp_path, "[guard]\n")) is None


@pytest.mark.parametrize("name", ['"axes"', "3", "true"])
def test_an_unknown_machine_is_refused_with_the_list(tmp_path, name):
    with pytest.raises(InputError) as error:
        machine.chosen(file(tmp_path, f"machine = {name}\n"))
    assert "machine.toml, machine" in str(error.value)
    assert "two_stage" in error.value.accepted and "axis" in error.value.accepted


def test_a_machine_is_loaded_with_what_follows(tmp_path):
    found, tree = machine.load(file(tmp_path, 'machine = "axis"\n[load]\npayload = "1 kg"\n'))
    assert found.name == "axis" and tree == DEFAULT.with_("load.payload", "1 kg")
    assert machine.load(file(tmp_path, 'machine = "axis"\n'))[1] == DEFAULT
    with pytest.raises(InputError, match="payloat"):
        machine.load(file(tmp_path, 'machine = "axis"\n[load]\npayloat = "1 kg"\n'))
    with pytest.raises(InputError, match="two_stage"):
        machine.load(file(tmp_path, 'machine = "two_stage"\n'))


def test_all_settings_as_toml_are_read_back_bit_for_bit(tmp_path):
    tree = DEFAULT.with_({"load.payload": "0.123456789 kg", "drive.kind": "screw"})
    assert machine.load(file(tmp_path, machine.as_toml(tree)))[1] == tree
    assert machine.as_toml(tree, "load").startswith("[load]")


def test_a_file_for_another_machine_is_refused_by_who_knows_one(tmp_path):
    with pytest.raises(InputError, match='"two_stage" here'):
        config.load_overrides(file(tmp_path, 'machine = "axis"\n'), Settings())
    named = file(tmp_path, 'machine = "two_stage"\n[guard]\npush = "3.5 V"\n')
    assert config.load_overrides(named, Settings()).guard.push == 3.5
    assert (
        config.load_overrides(file(tmp_path, 'machine = "two_stage"\n'), Settings()) == Settings()
    )
