"""An axis that turns on: no stops, places that count on, what names its place."""

import math

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.machines import contract, homing, machine, planning, runs
from macromicro.machines.rotary import DEFAULT
from macromicro.machines.sheets import TURN
from macromicro.machines.tree import derive_all

ROTARY = machine.MACHINES[3]
ENDLESS = DEFAULT.with_("load.ends", "none")
MARKED = DEFAULT.with_(
    {
        "load.ends": "none",
        "encoder.at": "load",
        "encoder.counts": 40000,
        "encoder.index_pulse": "mark",
        "travel.low": "-1000 turn",
        "travel.high": "1000 turn",
    }
)


def test_it_keeps_what_every_machine_must():
    assert contract.broken(ROTARY._replace(settings=ENDLESS)) == []


def test_nothing_ends_its_way_but_what_is_watched():
    p = ROTARY.kind.prepare(ENDLESS).load
    assert (p.stop_low, p.stop_high) == (-math.inf, math.inf)
    assert (ENDLESS.travel.low, ENDLESS.travel.high) == (-TURN, TURN)
    assert (ENDLESS.guard.low, ENDLESS.guard.high) == pytest.approx((-1.5 * TURN, 1.5 * TURN))
    assert MARKED.guard.high == pytest.approx(1000.5 * TURN)
    assert derive_all(ENDLESS) == ENDLESS
    assert DEFAULT.with_({"load.ends": "none"}).with_({"load.ends": "stops"}) == DEFAULT


@pytest.mark.slow
def test_its_place_counts_on_and_the_pulse_comes_each_turn(tmp_path):
    path = tmp_path / "far.toml"
    path.write_text('[[moves]]\nmacro = ["10 turn", "-3.25 turn"]\nhold = "4 s"\n', "utf-8")
    plan = planning.plan(planning.load(path, MARKED), MARKED)
    done = runs.record(machine.under(ROTARY, MARKED), MARKED, plan, seed=2)
    assert done.outcome.fault is None and np.max(done.recording["arrived"]) == 1.0
    turns = done.recording["true_position"] / 360.0
    assert np.max(turns) == pytest.approx(10.0, abs=1e-3)
    assert turns[-1] == pytest.approx(-3.25, abs=1e-3)
    pulses = done.recording["index_count"] * MARKED.encoder.pitch / TURN
    pulses = pulses[~np.isnan(pulses)]
    assert pulses == pytest.approx(np.round(pulses), abs=1e-4)
    assert set(np.round(pulses)) >= set(range(-3, 10))


def test_beyond_its_travel_a_target_is_refused(tmp_path):
    path = tmp_path / "far.toml"
    path.write_text('[[moves]]\nmacro = "2 turn"\nhold = "4 s"\n', "utf-8")
    with pytest.raises(InputError) as error:
        planning.plan(planning.load(path, ENDLESS), ENDLESS)
    assert "-360 deg to 360 deg" in error.value.accepted


def test_what_names_its_place_follows_from_its_mark():
    assert ENDLESS.homing.on == "start" and homing.touch(ENDLESS) is None
    assert MARKED.homing.on == "index"
    touch = homing.touch(MARKED)
    assert touch.place == touch.out == 0.0  # it stays at the mark
    # A turn at the speed of the search, not a thousand.
    assert TURN / touch.speed < touch.patience < 16.0 * 1.5 * TURN / touch.speed + 60.0
    moved = MARKED.with_("encoder.index_place", "90 deg")
    assert homing.touch(moved).place == pytest.approx(0.25 * TURN)
    assert math.isnan(homing.touch(DEFAULT).out)


@pytest.mark.parametrize(
    ("changes", "path", "words"),
    [
        ({"load.ends": "none", "homing.on": "stop"}, "homing.on", '"start"'),
        ({"homing.on": "start"}, "homing.on", 'ends = "none"'),
        ({"load.ends": "none", "switches.limits": "both"}, "switches.limits", '"none"'),
        ({"load.ends": "none", "switches.home": "cam"}, "switches.home", '"none"'),
        ({"load.ends": "none", "homing.on": "index"}, "homing.on", "encoder.index_pulse"),
        ({"load.ends": "maybe"}, "load.ends", "stops"),
        (
            {"load.ends": "none", "encoder.bits": 16, "travel.high": "10 turn"},
            "encoder.bits",
            "the end of its way",
        ),
    ],
)
def test_what_cannot_be_is_refused(changes, path, words):
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert path in error.value.where and words in error.value.accepted, error.value.accepted
