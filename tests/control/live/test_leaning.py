"""Homing and jogs are over before the guard takes the carriage for stuck."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.control.live import leaning
from macromicro.control.live.parameters import Live
from macromicro.errors import InputError
from macromicro.rig.limits import LIVE
from macromicro.serve.settings import LiveSettings, load


def test_the_defaults_leave_the_guard_its_margin() -> None:
    assert leaning.problems(Live(), LIVE.lean, LIVE.leant) == []
    assert leaning.longest(Live()) == pytest.approx(0.6)
    assert LiveSettings().together() == []


@pytest.mark.parametrize(("text", "key", "words"), [
    ("[live.homing]\nstand = '0.46 s'", "live.homing.stand", "at most 0.45 s"),
    ("[live.jogging]\npatience = '1 s'", "live.jogging.patience", "at most 0.9 s"),
    ("[guard]\nleant = '0.65 s'", "live.homing.stand", "at most 0.2925 s"),
    ("[live.jogging]\nlean = '3 V'", "live.jogging.lean", "guard.lean (2.9 V)"),
])  # fmt: skip
def test_times_that_the_guard_would_cut_short_are_refused(
    tmp_path: Path, text: str, key: str, words: str
) -> None:
    path = tmp_path / "station.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load(path)
    assert key in str(caught.value) and words in str(caught.value)
    if key.endswith(("stand", "patience")):
        assert "guard.leant" in str(caught.value)


def test_times_within_the_margin_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "station.toml"
    path.write_text("[live.homing]\nstand = '0.45 s'\n[live.jogging]\npatience = '0.9 s'")
    assert load(path).live.homing.stand == 0.45


@pytest.mark.parametrize("leant", [0.7, 2.0])
def test_a_jogs_patience_is_judged_by_the_guards(leant: float) -> None:
    """Nine tenths of it may be used up."""
    for patience, fits in ((0.89 * leant, True), (0.91 * leant, False)):
        live = Live()._replace(jogging=Live().jogging._replace(patience=patience))
        paths = [path for path, _, _ in leaning.problems(live, LIVE.lean, leant)]
        assert ("live.jogging.patience" not in paths) == fits
