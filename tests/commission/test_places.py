"""What can be commissioned, and what is known of it beforehand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from macromicro.commission import kinds, places
from macromicro.errors import InputError
from macromicro.machines import machine
from macromicro.settings import Settings

ROOT = Path(__file__).parents[2]


def test_the_virtual_carriage() -> None:
    place = places.virtual(None)
    settings = Settings()
    assert place.pitch == settings.sensors.encoder.pitch
    assert place.effort == settings.controller.motor_limit
    assert place.dt == 1e-3
    assert not place.real
    assert "encoder" in place.make(0).channels


def test_a_virtual_machine_is_known_by_pitch_period_and_range_alone() -> None:
    path = ROOT / "examples" / "machines" / "stage.toml"
    tree = machine.load(path)[1]
    place = places.virtual(path)
    assert (place.pitch, place.dt) == (tree.encoder.pitch, tree.timing.period)
    assert place.effort == tree.controller.limit
    assert place.name == "the machine of stage.toml"
    assert not place.real


def test_every_kind_of_stage_has_its_own_steps() -> None:
    for name in ("piezo-100um.toml", "wire-100um.toml"):
        path = ROOT / "examples" / "machines" / name
        place, (chosen, tree) = places.virtual(path), machine.load(path)
        assert place.kind.name == chosen.name
        # What a person knows: the range of the D/A. Nothing of it is below zero for a wire.
        assert (place.lowest, place.effort) == (tree.controller.low, tree.controller.high)
    assert {m.name for m in machine.MACHINES} == set(kinds.NAMES)
    assert kinds.by_name("crane") is None


def test_a_kind_that_cannot_be_commissioned_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kinds, "KINDS", kinds.KINDS[:1])
    with pytest.raises(InputError, match="piezo"):
        places.virtual(ROOT / "examples" / "machines" / "piezo-100um.toml")


def test_a_rig_of_one_s_own_may_not_say_its_largest_effort(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "minelab.py").write_text(
        "from tests.commission.axes import Virtual\n"
        "def bench(seed):\n    return Virtual()\n"
        "def blind(seed):\n    rig = Virtual()\n    rig.channels = ('hall',)\n    return rig\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    place = places.own_place("minelab:bench", 5e-6, 0)
    assert place.real and place.pitch == 5e-6
    assert math.isnan(place.effort)
    assert place.kind.name == "axis" and place.lowest is None
    other = places.own_place("minelab:bench", 5e-6, 0, "piezo", -2.0)
    assert other.kind.name == "piezo" and other.lowest == -2.0
    assert places.own_place("minelab:bench", 5e-6, 0, "wire").lowest == 0.0
    with pytest.raises(InputError, match="encoder"):
        places.own_place("minelab:blind", 5e-6, 0)
    with pytest.raises(InputError, match="--kind"):
        places.own_place("minelab:bench", 5e-6, 0, "crane")
    with pytest.raises(InputError, match="--lowest"):
        places.own_place("minelab:bench", 5e-6, 0, "axis", -2.0)
