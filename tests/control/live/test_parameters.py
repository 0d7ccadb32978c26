"""Settings of the live machine."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.control.live.parameters import Live
from macromicro.errors import InputError
from macromicro.plant.encoder import Encoder
from macromicro.rig.limits import Limits
from macromicro.schema import config
from macromicro.schema.par import entries


def test_every_setting_says_what_it_is() -> None:
    for entry in entries(Live()):
        assert entry.par.meaning, entry.path
        assert entry.par.lo <= entry.value <= entry.par.hi, entry.path


def test_they_travel_through_a_file(tmp_path: Path) -> None:
    file = tmp_path / "live.toml"
    file.write_text(config.as_toml(Live()))
    assert config.load_overrides(file, Live()) == Live()


@pytest.mark.parametrize("text", [
    '[limits]\nmacro_low = "3000 count"', '[limits]\nmicro_low = "3.6 mm"',
    '[limits]\nwhole_high = "-10 mm"', '[fine]\nbias_low = "3.6 mm"',
    '[fine]\nband = "0 um"',
])  # fmt: skip
def test_what_cannot_be_is_refused(text: str, tmp_path: Path) -> None:
    file = tmp_path / "live.toml"
    file.write_text(text)
    with pytest.raises(InputError):
        config.load_overrides(file, Live())


def test_the_homing_push_is_no_reason_for_the_guard() -> None:
    assert Live().homing.volts < Limits().push
    assert Live().pitch == Encoder().pitch
