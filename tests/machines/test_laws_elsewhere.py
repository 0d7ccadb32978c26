"""A law whose gains are a model of another machine's stage runs on no other."""

import pytest

from macromicro import cli
from macromicro.control import outside
from macromicro.control.stage_law import StageLaw
from macromicro.errors import InputError
from macromicro.machines import compositions
from tests.command import BARE

LAWS = {**dict.fromkeys(outside.SHIPPED, "macro"), **dict.fromkeys(outside.FINE, "micro")}
OTHERS = [c.name for c in compositions.MACHINES if c.name != "two_stage"]


def refused(monkeypatch, capsys, *words):
    monkeypatch.setattr("sys.argv", ["macromicro", *map(str, words)])
    assert cli.main() == 2
    return capsys.readouterr().err


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("machine", OTHERS)
@pytest.mark.parametrize("on", ["the twin", "a rig"])
def test_before_anything_moves_it_is_refused(machine, law, on, tmp_path, monkeypatch, capsys):
    step = machine == "xy"
    names = ("x.law", "y.law") if step else ("law",)
    faulty = "faulty.stage"
    rig = "twin" if on == "the twin" else f"{faulty}:x+{faulty}:y" if step else f"{faulty}:stage"
    for name in names:
        (tmp_path / "m.toml").write_text(f'machine = "{machine}"\n{name} = "{law}"\n')
        words = (*BARE, "--config", tmp_path / "m.toml", "--out", tmp_path / "out", "--rig", rig)
        said = refused(monkeypatch, capsys, *words)
        assert f"law: the gains of {law} are a model of the {LAWS[law]}-stage" in said
    if not step:
        (tmp_path / "m.toml").write_text(f'machine = "{machine}"\n')
        assert law in refused(monkeypatch, capsys, *words, "--law", law)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("law", LAWS)
def test_nor_does_the_other_stage_of_its_own_machine_run_under_it(
    law, tmp_path, monkeypatch, capsys
):
    other = "micro" if LAWS[law] == "macro" else "macro"
    (tmp_path / "m.toml").write_text(f'controller.{other}_law = "{law}"\n')
    said = refused(monkeypatch, capsys, "config", "show", "--config", tmp_path / "m.toml")
    assert f"controller.{other}_law: the gains of {law} are a model" in said


def test_a_law_of_ones_own_may_say_whose_model_it_has():
    law = outside.find("terminal", "")
    with pytest.raises(InputError, match="model_of of mine: 'nano'; accepted: '' or 'macro'"):
        outside.check(law._replace(model_of="nano"), "mine", "--law")
    assert StageLaw._field_defaults["model_of"] == ""
