"""What can be commissioned, and what is known of it beforehand."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from macromicro.commission import places
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


def test_other_stages_are_refused() -> None:
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
    place = places.own("minelab:bench", 5e-6, 0)
    assert place.real and place.pitch == 5e-6
    assert math.isnan(place.effort)
    with pytest.raises(InputError, match="encoder"):
        places.own("minelab:blind", 5e-6, 0)
