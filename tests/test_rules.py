"""Settings that do not work with one another are refused, with the reason and the remedy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from macromicro.errors import InputError
from macromicro.rules import breakaway, live
from macromicro.schema.config import load_overrides
from macromicro.schema.par import changed
from macromicro.serve.settings import LiveSettings
from macromicro.settings import Settings


@pytest.mark.parametrize("tree", [Settings(), LiveSettings()])
def test_the_defaults_work(tree: Any) -> None:
    assert tree.together() == []


@pytest.mark.parametrize(("text", "where", "reason", "remedy"), [
    ('[bench.thermal]\nambient = "60 degC"',
     "bench.thermal.ambient", "do not extend again", "a cooler room"),
    ('[sensors.hall]\nnoise = "0 mV"', "sensors.hall.noise", "takes it for frozen", "at least"),
    ('[sensors.hall]\nnoise = "0.05 mV"', "sensors.hall.noise", "guard.frozen (0.5 s)", "bits"),
    ('[sensors.hall]\nnoise = "30 mV"', "sensors.hall.noise", "faulty", "below guard.noise"),
    ('[sensors.hall]\ngain = "9 V"', "sensors.hall.", "0", "V"),
    ('[sensors.hall]\nspacing = "0.2 mm"', "sensors.hall.spacing", "turning", "magnets"),
    ('[sensors.converter]\nfull_scale = "3 V"',
     "sensors.converter.full_scale", "greatest output", "above"),
    ('[bench.friction]\ncoulomb = "30 N"',
     "bench.friction.coulomb", "needs 7.51 V", "bench.amplifier.supply"),
    ('[bench.amplifier]\nsupply = "10 V"\nctrl_duty = 0.4',
     "bench.friction.coulomb", "5.99 V", "a higher bench.amplifier.supply (10 V)"),
    ('[bench.driver]\nsupply = "0.8 V"', "bench.driver.supply", "contracted", "higher supply"),
    ('[guard]\nhottest = "30 degC"', "guard.hottest", "every contraction", "above 43"),
    ('[guard]\nlean = "3.7 V"', "guard.lean", "guard.push (3.6 V)", "at most"),
    ('[guard]\nsilent = "0.5 ms"', "guard.silent", "one control period", "at least 1 ms"),
    ('[guard]\nfastest = "5000 count/s"', "guard.fastest", "without load", "above 17"),
    ('[sensors.encoder]\nbits = 8', "sensors.encoder.bits", "wrapping", "3000 counts"),
    ('[controller.sequence]\ntolerance = "120 count"',
     "controller.sequence.tolerance", "twice bench.wire.stroke", "at most 113 counts"),
    ('[controller]\ndead_zone = "5 V"', "controller.dead_zone", "motor_limit (5 V)", "below"),
])  # fmt: skip
def test_what_cannot_work_together_is_refused(
    text: str, where: str, reason: str, remedy: str, tmp_path: Path
) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_overrides(path, Settings())
    said = str(caught.value)
    assert f"mine.toml, {where}" in said and reason in said and remedy in said, said


def test_homing_leans_on_the_stop_within_the_guards_margin() -> None:
    assert LiveSettings().live.homing.leans == pytest.approx(0.6)


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
        load_overrides(path, LiveSettings())
    assert key in str(caught.value) and words in str(caught.value)
    if key.endswith(("stand", "patience")):
        assert "guard.leant" in str(caught.value)


def test_times_within_the_margin_are_taken(tmp_path: Path) -> None:
    path = tmp_path / "station.toml"
    path.write_text("[live.homing]\nstand = '0.45 s'\n[live.jogging]\npatience = '0.9 s'")
    assert load_overrides(path, LiveSettings()).live.homing.stand == 0.45


@pytest.mark.parametrize("leant", [0.7, 2.0])
def test_a_jogs_patience_is_judged_by_the_guards(leant: float) -> None:
    """Nine tenths of it may be used up."""
    own = LiveSettings()
    for patience, fits in ((0.89 * leant, True), (0.91 * leant, False)):
        jogging = own.live.jogging._replace(patience=patience)
        tree = own._replace(
            live=own.live._replace(jogging=jogging), guard=own.guard._replace(leant=leant)
        )
        assert ("live.jogging.patience" not in [path for path, _, _ in live(tree)]) == fits


@pytest.mark.parametrize(("text", "where"), [
    ('[live.jogging]\nmacro = "900 mm/s"', "live.jogging.macro"),
    ('[live.limits]\nmicro_high = "3.95 mm"', "live.limits.micro_high"),
    ('[bench.friction]\ncoulomb = "13 N"', "live.homing.volts"),
])  # fmt: skip
def test_of_the_live_machine_too(text: str, where: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=where):
        load_overrides(path, LiveSettings())


def test_less_noise_goes_with_a_finer_converter(tmp_path: Path) -> None:
    """The remedy that the message names is one."""
    path = tmp_path / "mine.toml"
    path.write_text('[sensors.hall]\nnoise = "0.05 mV"\n[sensors.converter]\nbits = 16\n')
    assert load_overrides(path, Settings()).sensors.hall.noise == 5e-5


def test_breakaway_is_that_of_the_bench() -> None:
    """M1: the dead zone is near 3 V; friction that doubles takes that much more."""
    assert breakaway(Settings()) == pytest.approx(2.995, abs=0.005)
    friction = Settings().bench.friction
    more = changed(Settings(), {"bench.friction.coulomb": 2.0 * friction.coulomb})
    pulled = friction.coulomb / (friction.coulomb + friction.stribeck + friction.ripple)
    assert breakaway(more) == pytest.approx(breakaway(Settings()) * (1.0 + pulled))
