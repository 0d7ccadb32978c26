"""An axis that a motor turns: the physics of one that slides, in the units of what turns."""

import math
import re

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.machines import (
    axis,
    contract,
    guarding,
    homing,
    machine,
    parts,
    planning,
    runs,
    sheets,
)
from macromicro.machines.guard_words import LIMIT_HIGH
from macromicro.machines.rotary import DEFAULT
from macromicro.machines.tree import derive_all
from macromicro.place import ANGLE
from macromicro.plant import power
from macromicro.plant.transmission import Transmission
from macromicro.schema.par import entries

AXIS, ROTARY = machine.MACHINES[0], machine.MACHINES[3]
DEG = math.pi / 180.0


@pytest.mark.slow  # test_endless.py looks at the same kind
def test_it_keeps_what_every_machine_must():
    assert ROTARY.name == "rotary" and ROTARY.kind.place is ANGLE
    assert contract.broken(ROTARY) == []


def test_no_setting_is_in_units_of_a_slide():
    for entry in entries(DEFAULT):
        for unit in (entry.par.unit, entry.par.read_in):
            rest = unit.replace("kg*m^2", "").replace("N*m", "")
            assert not {"m", "mm", "um", "N", "kg"} & set(re.findall("[A-Za-z]+", rest)), entry.path


def sliding(tree):
    """An axis of the same numbers: a belt on a pulley of 1 m, so that 1 rad is 1 m."""
    gear, load, encoder = tree.drive._asdict(), tree.load._asdict(), tree.encoder._asdict()
    drive = {"radius": 1.0, "gear": gear.pop("ratio"), **gear}
    ends = {name: load[name] for name in load if name.startswith("stop_")}
    slide = parts.Load(mass=load["inertia"], payload=load["payload"], **ends)
    same = {name: getattr(tree, name) for name in tree._fields if name not in {"load", "encoder"}}
    return axis.DEFAULT._replace(
        **same
        | {
            "motor": power.Motor(**tree.motor._asdict()),
            "drive": Transmission(**drive),
            "load": slide,
            "encoder": parts.Feedback(lines=0.25 * encoder.pop("counts"), **encoder),
        }
    )


def test_it_does_what_an_axis_of_the_same_numbers_does():
    tree = DEFAULT.with_(
        {
            "drive.frequency": "40 Hz",
            "drive.backlash": "0.02 deg",
            "drive.cogging": "0.01 N*m",
            "drive.error": "10 mdeg",
            "friction.ripple": "0.01 N*m",
            "load.payload": "0.004 kg*m^2",
            "encoder.noise": "1 mdeg",
        }
    )
    same = sliding(tree)
    plan = planning.plan(planning.usual(tree), tree)
    turned = runs.record(ROTARY, tree, plan, seed=3).recording
    slid = runs.record(AXIS, same, plan, seed=3).recording
    assert np.array_equal(turned["effort"], slid["effort"])
    assert np.array_equal(turned["arrived"], slid["arrived"])
    for name in ("position", "target", "true_position", "true_speed", "speed"):
        assert turned[name] * DEG == pytest.approx(slid[name] / 1e3, rel=1e-12, abs=1e-15)
    units = {c.name: c.unit for c in turned.columns}
    assert (units["position"], units["true_speed"]) == ("deg", "deg/s")
    assert units["target_acceleration"] == "rad/s^2" and units["effort"] == "V"


def test_gear_and_inertias_are_seen_at_the_load():
    tree = DEFAULT.with_({"drive.ratio": 25, "load.payload": "0.002 kg*m^2"})
    assert sheets.constant(tree) == pytest.approx(25 * 0.0302)
    assert sheets.turning(tree) == pytest.approx(625 * 2.4e-6)
    assert sheets.mass(tree) == pytest.approx(625 * 2.4e-6 + 0.012)
    assert sheets.weight(tree) == 0.0
    heavier = tree._replace(load=tree.load.times(2.0))
    assert sheets.mass(heavier) - sheets.mass(tree) == pytest.approx(0.012)


def test_counts_are_those_of_a_turn_of_what_the_encoder_sits_on():
    assert DEFAULT.encoder.pitch == pytest.approx(2.0 * math.pi / 40_000)
    at_load = DEFAULT.with_({"encoder.at": "load", "encoder.counts": 16384})
    assert at_load.encoder.pitch == pytest.approx(2.0 * math.pi / 16384)


def test_what_follows_is_rounded_as_it_is_read():
    assert derive_all(DEFAULT) == DEFAULT
    tree = DEFAULT.with_({"load.stop_high": "123.4567 deg", "drive.ratio": 7})
    for name in ("velocity", "acceleration", "jerk"):
        shown = math.degrees(getattr(tree.motion, name))
        assert float(f"{shown:.4g}") == pytest.approx(shown, rel=1e-12)
    assert tree.travel.high == pytest.approx(120.9 * DEG)  # 2 % of 128.5 deg stay free


def test_its_settings_are_read_back(tmp_path):
    tree = DEFAULT.with_({"drive.ratio": 4.3, "encoder.at": "load", "motion.velocity": "20 rpm"})
    assert tree.motion.velocity == pytest.approx(20 * 6 * DEG)
    path = tmp_path / "m.toml"
    path.write_text(machine.as_toml(ROTARY, tree), encoding="utf-8")
    found, again = machine.load(path)
    assert found == ROTARY and again == tree
    assert type(again.guard) is type(tree.guard)


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ({"friction.coulomb": "2 N*m"}, "friction.coulomb", ("N*m", "4 A")),
        ({"motion.velocity": "9000 deg/s"}, "motion.velocity", ("deg/s",)),
        ({"motion.acceleration": "2e5 deg/s^2"}, "motion.acceleration", ("deg/s^2", "kg*m^2")),
        ({"travel.high": "280 deg"}, "travel.high", ("275 deg",)),
        ({"drive.backlash": "0.1 deg"}, "drive.backlash", ("0 deg",)),
        ({"arrival.tolerance": "1 mdeg"}, "arrival.tolerance", ("0.009 deg",)),
        ({"travel.high": "200 mm"}, "travel.high", ("deg",)),
        ({"encoder.rate": "1000 counts/s"}, "guard.error", ()),
    ],
)
def test_what_it_cannot_is_refused_in_its_own_units(changes, path, words):
    if path == "guard.error":  # a slow counter makes the speed follow, and is not refused
        assert DEFAULT.with_(changes).motion.velocity < 0.2
        return
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert path in error.value.where
    assert all(word in error.value.accepted for word in words)
    assert " m/s" not in error.value.accepted and "mm or" not in error.value.accepted


def programme(folder, text, tree=DEFAULT, name="p.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return planning.plan(planning.load(path, tree), tree)


def test_targets_are_angles(tmp_path):
    text = '[[moves]]\nmacro = ["90 deg", "0.5 turn", "1 rad", "1000 counts"]\nhold = "0.1 s"\n'
    wanted = [90 * DEG, 180 * DEG, 1.0, 1000 * DEFAULT.encoder.pitch]
    half = 0.5001 * DEFAULT.encoder.pitch
    assert programme(tmp_path, text).target == pytest.approx(wanted, abs=half)
    profiled = '[[profiles]]\nmacro = "90 deg"\nvelocity = "30 rpm"\n'
    profiled += 'acceleration = "500 deg/s^2"\nhold = "0.1 s"\n'
    # 90 deg at 180 deg/s, after 0.36 s of acceleration
    assert programme(tmp_path, profiled).length == pytest.approx([0.5 + 0.36], abs=2e-3)
    made = programme(tmp_path, "t_s,macro_deg\n0,0\n1,45\n3,0\n4,0\n", name="p.csv")
    assert made.target == pytest.approx([45 * DEG, 0.0], abs=half)


@pytest.mark.parametrize(
    ("text", "name", "accepted"),
    [
        ('[[moves]]\nmacro = "25 mm"\nhold = "1 s"\n', "p.toml", "this stage is rotary"),
        ('[[moves]]\nmacro = "300 deg"\nhold = "1 s"\n', "p.toml", "0 deg to 269.397 deg"),
        ("t_s,macro_mm\n0,0\n1,45\n3,0\n4,0\n", "p.csv", "position_deg"),
        ('[[moves]]\nmicro = "2 deg"\nhold = "1 s"\n', "p.toml", "Accepted: one of to, hold"),
        (
            '[[profiles]]\nmacro = "90 deg"\nvelocity = "0.3 m/s"\nacceleration = "1 rad/s^2"\n'
            'hold = "1 s"\n',
            "p.toml",
            "rad/s",
        ),
        ("t_s,macro_deg\n0,0\n1,200\n1.05,0\n4,0\n", "p.csv", "motion.velocity"),
    ],
)
def test_lengths_and_places_beyond_its_turn_are_refused(tmp_path, text, name, accepted):
    with pytest.raises(InputError) as error:
        programme(tmp_path, text, name=name)
    assert accepted in str(error.value)


def test_angles_are_refused_by_an_axis_that_slides(tmp_path):
    with pytest.raises(InputError, match="mm"):
        programme(tmp_path, '[[moves]]\nmacro = "25 deg"\nhold = "1 s"\n', AXIS.settings)
    with pytest.raises(InputError, match="position_mm"):
        programme(tmp_path, "t_s,macro_deg\n0,0\n1,4\n3,4\n", AXIS.settings, "p.csv")


def test_the_guard_speaks_of_degrees():
    watch = guarding.fresh()._replace(fault=guarding.HIGH, value=1.0, limit=0.5)
    assert (
        "position 57.2958 deg, allowed at most 28.6479 deg"
        in guarding.describe(watch, ANGLE).evidence
    )
    assert "position 1000.0000 mm" in guarding.describe(watch).evidence
    fast = watch._replace(fault=guarding.FAST)
    assert "57.3 deg/s" in guarding.describe(fast, ANGLE).evidence
    tight = DEFAULT.with_("guard.error", "0.005 deg")
    done = runs.record(ROTARY, tight, planning.usual(tight))
    assert "deg, allowed 0.005 deg" in done.outcome.fault.evidence


def test_its_model_is_that_of_the_axis_in_radians():
    frequency = np.array([1.0, 20.0])
    found = ROTARY.model(DEFAULT, frequency)
    assert found == pytest.approx(sheets.plant(DEFAULT, frequency))
    # Far below its poles: volts to speed by the back-EMF and the viscous friction.
    k, friction = 0.302, 0.005
    slow = 2.4 * k / (1.2 * friction + k * k)
    low = ROTARY.model(DEFAULT, np.array([1e-3]))[0]
    assert abs(low) * 2.0 * math.pi * 1e-3 == pytest.approx(slow, rel=1e-3)


def test_it_feels_for_its_stop_slowly():
    touch = homing.touch(DEFAULT)
    assert 0.0 < touch.slow < touch.speed < DEFAULT.motion.velocity
    assert touch.place == pytest.approx(DEFAULT.load.stop_low, abs=2e-3)


def test_its_switches_and_pulses_are_recorded():
    tree = DEFAULT.with_(
        {"switches.limits": "both", "switches.home": "cam", "encoder.index_pulse": "turn"}
    )
    done = runs.record(machine.under(ROTARY, tree), tree, planning.usual(tree), seed=1)
    assert done.outcome.fault is None
    seen = done.recording
    assert not np.any(seen["limit_low"]) and not np.any(seen["limit_high"])
    cam = seen["true_position"][seen["home"] == 1.0] * DEG
    top, width = tree.switches.home_place, tree.switches.home_width
    assert len(cam) > 0
    assert np.min(cam) > top - width - 0.05 and np.max(cam) < top + 0.05
    pulses = seen["index_count"][~np.isnan(seen["index_count"])] * tree.encoder.pitch
    off = (pulses - tree.encoder.index_place) / (2.0 * math.pi / tree.drive.ratio)
    assert len(pulses) > 10, "one per turn of the motor"
    assert off == pytest.approx(np.round(off), abs=1e-3)


def test_a_limit_switch_catches_what_runs_away():
    tree = DEFAULT.with_({"switches.limits": "both"})
    # It has come loose, and stands where the way goes on.
    loose = tree._replace(switches=tree.switches._replace(high=1.0))
    done = runs.record(machine.under(ROTARY, loose), loose, planning.usual(loose), seed=1)
    assert done.outcome.watch.fault == LIMIT_HIGH
    assert done.recording["limit_high"][-1] == 1.0 and done.recording["effort"][-1] == 0.0
    assert "deg" in done.outcome.fault.evidence and "mm" not in done.outcome.fault.evidence
    assert done.outcome.watch.value == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        (
            {"switches.limits": "low", "switches.low": "10 deg"},
            "switches.low",
            ("-0.07 deg: it is to have let go",),
        ),
        (
            {"switches.home": "cam", "switches.home_width": "0.001 deg"},
            "switches.home_width",
            ("deg or more", "speed of the search"),
        ),
        ({"homing.on": "home"}, "homing.on", ("switches.home",)),
        ({"encoder.at": "load", "encoder.index_pulse": "turn"}, "encoder.index_pulse", ("mark",)),
    ],
)
def test_switches_that_cannot_be_are_refused_in_degrees(changes, path, words):
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert path in error.value.where
    assert all(word in error.value.accepted for word in words), error.value.accepted
    assert "mm" not in error.value.accepted
