"""Each quantity is set once: what follows from it follows, and what contradicts it is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from macromicro import programme
from macromicro.errors import InputError
from macromicro.runs.programmed import load
from macromicro.schema.config import as_toml, load_overrides
from macromicro.schema.par import changed, entries, value_at
from macromicro.serve.settings import LiveSettings
from macromicro.settings import Settings


def read(folder: Path, text: str, tree: Any = None) -> Any:
    file = folder / "mine.toml"
    file.write_text(text)
    return load_overrides(file, LiveSettings() if tree is None else tree)


@pytest.mark.parametrize("tree", [Settings(), LiveSettings()])
def test_every_default_is_what_its_rule_gives(tree: Any) -> None:
    """Also after a change to something else, so a rule names a parameter that is there."""
    known = {entry.path for entry in entries(tree)}
    for path, rule in tree.derived():
        assert path in known
        assert value_at(tree, path) == rule(tree), path


@pytest.mark.parametrize("tree", [Settings(), LiveSettings()])
def test_no_rule_depends_on_a_later_one(tree: Any) -> None:
    """A machine in which all that rules read is different: every rule holds afterwards."""
    changes = {
        "sensors.encoder.pitch": 50e-6,
        "bench.carriage.stop_low": -12e-3,
        "bench.carriage.stop_high": 0.31,
        "bench.wire.stop": 3.5e-3,
        "bench.amplifier.full_scale": 10.0,
        "sensors.hall.supply": 6.0,
        "sensors.hall.lag": 1e-3,
        "guard.push": 4.0,
        "guard.lean": 3.2,
    }
    new = changed(tree, changes)
    for path, rule in tree.derived():
        assert value_at(new, path) == rule(new), path


def test_the_push_is_set_once(tmp_path: Path) -> None:
    """Homing pushes less than the guard takes for a stuck carriage."""
    assert read(tmp_path, '[guard]\npush = "3.3 V"').live.homing.volts == pytest.approx(3.1)
    with pytest.raises(InputError, match=r"live\.homing\.volts.*2\.8.*3 V.*guard\.push"):
        read(tmp_path, '[guard]\npush = "3.0 V"')
    with pytest.raises(InputError, match=r"live\.homing\.volts.*below guard\.push \(3\.6 V\)"):
        read(tmp_path, '[live.homing]\nvolts = "3.6 V"')


def test_the_pitch_is_set_once(tmp_path: Path) -> None:
    """The live machine has the encoder's; lengths that are set in counts stay as long."""
    fine = read(tmp_path, '[sensors.encoder]\npitch = "10 um"')
    assert fine.live.pitch == 10e-6
    old = LiveSettings()
    for path in ("guard.macro_tolerance", "guard.against", "live.homing.lead", "live.brake.margin"):
        long = value_at(old, path) * old.live.pitch
        assert value_at(fine, path) * 10e-6 == pytest.approx(long), path
    assert fine.live.limits.macro_high * 10e-6 == pytest.approx(0.2136, abs=1e-4)
    with pytest.raises(InputError, match=r"live\.pitch.*sensors\.encoder\.pitch \(71\.4286 um\)"):
        read(tmp_path, '[live]\npitch = "70 um"')


def test_travel_follows_the_stops(tmp_path: Path) -> None:
    """A long screw takes far targets, a short wire none beyond its stop."""
    target = tmp_path / "far.toml"
    target.write_text('[[moves]]\nmacro = "400 mm"\nhold = "1 s"\n')
    long = read(tmp_path, '[bench.carriage]\nstop_high = "414.3 mm"', Settings())
    assert long.travel.macro == pytest.approx(0.4)
    assert load(target, long).target[0] == 5600.0
    with pytest.raises(InputError, match="0 mm to 200 mm"):
        load(target, Settings())
    short = read(
        tmp_path,
        '[bench.wire]\nstroke = "0.1 mm"\nstop = "0.099 mm"\n[bench.driver]\n'
        'contract_on = "0.0985 mm"\ncontract_off = "0.098 mm"\nextend_on = "0.002 mm"\n'
        '[sensors.hall]\nspacing = "0.3 mm"\nwidth = "0.3 mm"\ncentre = "0.05 mm"\n'
        '[controller.sequence]\ntolerance = "1 count"\n',
        Settings(),
    )
    target.write_text('[[moves]]\nmicro = "3.5 mm"\nhold = "1 s"\n')
    with pytest.raises(InputError, match=r"0 mm to 0\.097"):
        load(target, short)
    for beyond, words in (("macro", "stop_high"), ("micro", "wire.stop")):
        with pytest.raises(InputError, match=words):
            read(tmp_path, f'[travel]\n{beyond} = "500 mm"', Settings())


def test_soft_limits_of_the_live_machine_follow_its_stops(tmp_path: Path) -> None:
    long = read(tmp_path, '[bench.carriage]\nstop_high = "414.3 mm"').live
    assert long.limits.macro_high == 5790.0
    assert long.limits.whole_high == pytest.approx(0.4169, abs=2e-4)
    with pytest.raises(InputError, match=r"live\.limits\.macro_high.*at most 3000 counts"):
        read(tmp_path, '[live.limits]\nmacro_high = "3500 count"')


def test_efforts_follow_the_converter(tmp_path: Path) -> None:
    """A law never asks for what the guard forbids."""
    low = read(tmp_path, '[guard]\nmotor = "4 V"', Settings())
    assert low.controller.motor_limit == 4.0
    wide = read(
        tmp_path, '[bench.amplifier]\nfull_scale = "10 V"\nctrl_duty = 0.4\nsupply = "40 V"',
        Settings(),
    )  # fmt: skip
    assert (wide.guard.motor, wide.controller.pi.high) == (10.0, 10.0)
    with pytest.raises(InputError, match=r"controller\.motor_limit.*guard\.motor \(4 V\)"):
        read(tmp_path, '[guard]\nmotor = "4 V"\n[controller]\nmotor_limit = "5 V"', Settings())
    with pytest.raises(InputError, match=r"guard\.motor.*bench\.amplifier\.full_scale \(5 V\)"):
        read(tmp_path, '[guard]\nmotor = "6 V"', Settings())


def test_what_a_user_sets_stays(tmp_path: Path) -> None:
    kept = read(tmp_path, '[guard]\npush = "3.5 V"\n[live.homing]\nvolts = "3.1 V"')
    assert kept.live.homing.volts == 3.1
    assert kept.live.jogging.lean == LiveSettings().live.jogging.lean


@pytest.mark.parametrize("tree", [Settings(), LiveSettings()])
def test_all_that_is_shown_can_be_read_back(tree: Any, tmp_path: Path) -> None:
    assert read(tmp_path, as_toml(tree), tree) == tree


def test_shipped_programmes_stay_within_the_default_travel() -> None:
    for path in programme.shipped().values():
        assert len(load(path, Settings()).target)
