"""Which machine a settings file is for, and its settings."""

import pytest

from macromicro.errors import InputError
from macromicro.machines import machine, tree
from macromicro.machines.axis import DEFAULT
from macromicro.schema import config
from macromicro.settings import Settings
from tests.control.own_laws import Gains
from tests.machines import own

SLIDING = "tests.control.own_laws:sliding"
own.module()
flexure = own.module().flexure


def file(folder, text):
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_names_its_machine(tmp_path):
    assert machine.chosen(file(tmp_path, 'machine = "axis"\n')).name == "axis"
    for text in ('machine = "two_stage"\n', "[guard]\n"):
        with pytest.raises(InputError, match="'two_stage'; accepted: one of 'axis', 'piezo'"):
            machine.chosen(file(tmp_path, text))


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
    assert machine.load(file(tmp_path, machine.as_toml(machine.MACHINES[0], tree)))[1] == tree
    assert machine.as_toml(machine.MACHINES[0], tree, "load").startswith("[load]")


def test_a_file_for_another_machine_is_refused_by_who_knows_one(tmp_path):
    with pytest.raises(InputError, match='"two_stage" here'):
        config.load_overrides(file(tmp_path, 'machine = "axis"\n'), Settings())
    named = file(tmp_path, 'machine = "two_stage"\n[guard]\npush = "3.5 V"\n')
    assert config.load_overrides(named, Settings()).guard.push == 3.5
    assert (
        config.load_overrides(file(tmp_path, 'machine = "two_stage"\n'), Settings()) == Settings()
    )


def test_a_machine_of_another_package_is_known_by_the_name_it_was_given(monkeypatch):
    found = machine.named("ownlab:flexure", "test")
    assert found.name == "ownlab:flexure" and found.kind == flexure.kind
    assert machine.named("ownlab:flexure", "test") is found
    offered = {"lab-coil": "ownlab:flexure"}
    monkeypatch.setattr(
        machine.plugins, "entry_points", lambda group: offered if group == machine.GROUP else {}
    )
    assert machine.named("lab-coil", "test").name == "lab-coil"
    with pytest.raises(InputError, match="wire, rotary, lab-coil; or MODULE"):
        machine.named("lab-cool", "test")


def test_what_is_no_machine_is_refused():
    with pytest.raises(InputError, match=r"ownlab:Flexure, type'; accepted: a macromicro"):
        machine.named("ownlab:Flexure", "test")
    with pytest.raises(InputError, match="such as flexure"):
        machine.named("ownlab:flexur", "test")


def test_the_shipped_machines_have_their_tables():
    assert [m.spread.name for m in machine.MACHINES] == [
        "axis.toml",
        "piezo.toml",
        "wire.toml",
        "rotary.toml",
    ]
    assert all(m.spread.is_file() for m in machine.MACHINES)


def test_a_file_names_its_law_and_an_option_goes_before_it(tmp_path):
    path = tmp_path / "machine.toml"
    path.write_text(f'machine = "axis"\nlaw = "{SLIDING}"\n[own]\nslope = "9 1/s"\n')
    found, settings = machine.load(path)
    assert found.law.gains is Gains and settings.own.slope == 9.0
    again, same = machine.load(path, "cascade")
    assert again.law.name == "cascade" and tree.gains(same) == same.controller
    text = machine.as_toml(found, settings)
    assert text.startswith(f'machine = "axis"\nlaw = "{SLIDING}"') and 'slope = "9 1/s"' in text
    path.write_text(text)
    assert machine.load(path)[1] == settings
    path.write_text('machine = "axis"\n[load]\nmass = "1 kg"\n')
    optional, tuned = machine.load(path, SLIDING)
    assert optional.law.gains is Gains and tuned.own == Gains() and tuned.load.mass == 1.0
