"""What a served machine of one stage is set by, and under which law and guard it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.errors import InputError
from macromicro.machines import machine as machines
from macromicro.schema.par import replaced
from macromicro.serve import settings
from macromicro.serve.settings import LiveSettings, load
from macromicro.serve.stage import guide

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"
PRINTER = EXAMPLES / "printer.toml"


def written(folder: Path, text: str) -> Path:
    path = folder / "own.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_file_chooses_the_machine() -> None:
    found = load(PRINTER)
    assert isinstance(found, settings.StageSettings) and found.model == "axis printer"
    assert isinstance(load(None), LiveSettings)
    assert found.controller == found.tree.controller
    with pytest.raises(InputError, match="--law"):
        load(PRINTER, "pid")


def test_the_live_machine_has_the_travel_and_the_speeds_of_its_machine() -> None:
    found = settings.load(PRINTER)
    assert found is not None
    tree, live = found.tree, found.live
    assert live.pitch == tree.encoder.pitch
    assert (live.limits.whole_low, live.limits.whole_high) == (tree.travel.low, tree.travel.high)
    assert live.limits.macro_high == round(tree.travel.high / tree.encoder.pitch)
    assert live.jogging.macro == 0.25 * tree.motion.velocity
    assert live.jogging.slow < live.jogging.macro
    assert live.brake.deceleration == tree.motion.acceleration
    leads = guide.guide(found.machine, tree)
    assert leads.arrival.tolerance == tree.arrival.tolerance
    assert (leads.low, leads.high) == (tree.guard.low, tree.guard.high)
    assert leads.rubs
    for held in ("piezo-100um.toml", "wire-150um.toml"):
        assert not guide.guide(*machines.load(EXAMPLES / held)[:2]).rubs
    piezo = machines.load(EXAMPLES / "piezo-100um.toml")[1]
    assert guide.count(piezo) == pytest.approx(8.0 * piezo.encoder.noise)


def test_the_servers_table_stands_beside_the_machine(tmp_path: Path) -> None:
    text = PRINTER.read_text(encoding="utf-8")
    found = settings.load(written(tmp_path, text + '\n[serve]\nclient_timeout = "9 s"\n'))
    plain = settings.load(PRINTER)
    assert found is not None and plain is not None
    assert found.serve.client_timeout == 9.0 and found.tree == plain.tree
    with pytest.raises(InputError, match="live"):
        settings.load(written(tmp_path, text + "\n[live]\npitch = 1\n"))
    with pytest.raises(InputError, match=r"serve\.client_timeout"):
        settings.load(written(tmp_path, text + '\n[serve]\nclient_timeout = "0 s"\n'))
    whole = settings.load(written(tmp_path, 'machine = "axis"\n'))
    assert whole is not None and whole.tree == machines.MACHINES[0].settings


def test_a_kept_position_is_of_one_machine_with_its_settings(tmp_path: Path) -> None:
    found = settings.load(PRINTER)
    assert found is not None
    for path, value in (
        ("load.payload", "0.1 kg"),
        ("load.stop_low", "-12 mm"),
        ("encoder.pitch", "2 um"),
    ):
        other = found._replace(tree=found.tree.with_(path, value))
        assert found.kept_as("twin") != other.kept_as("twin")
    # What says how it moves costs no trust; where it leans on the stop may follow from a limit.
    for path, value in (
        ("controller.position", 20.0),
        ("motion.velocity", 0.1),
        ("guard.error", 0.005),
    ):
        same = found._replace(tree=replaced(found.tree, path, value))
        assert found.kept_as("twin") == same.kept_as("twin")
    assert found.place("twin") == other.place("twin") == "twin-axis"
    text = found.as_toml(found.controller, found.live.limits._replace(whole_high=0.1))
    again = settings.load(written(tmp_path, text))
    assert again is not None and again.tree.travel.high == 0.1
