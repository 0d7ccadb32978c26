"""The machine `wire`: what follows from its maker's table, what it cannot do, and how it runs."""

import math
from pathlib import Path

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.machines import (
    composite,
    machine,
    performing,
    period,
    planning,
    runs,
    stage,
    wire_sheets,
)
from macromicro.machines.stage import Bounds
from macromicro.machines.wire import DEFAULT, KIND, prepare
from macromicro.plant import wire as alloys

EXAMPLES = sorted((Path(__file__).parents[2] / "examples/machines").glob("wire-*.toml"))
WIDE = Bounds(-1.0, 1.0, 10.0)

CASES = [
    ({"bias.preload": "3 N"}, "bias.preload", "wire.stretch (3.49 N) or more"),
    ({"bias.rate": "2000 N/m"}, "bias.rate", "spring and guide make it 11.86 N"),
    ({"wire.heat_end": "87 degC"}, "wire.heat_end", "above wire.heat_start (88 degC)"),
    ({"wire.cool_start": "60 degC"}, "wire.cool_start", "above wire.cool_end (62 degC)"),
    ({"wire.heat_start": "60 degC", "wire.heat_end": "70 degC"}, "wire.cool_start", "below wire."),
    ({"driver.current": "0.4 A"}, "driver.current", "above 0.532 A: the wire reaches"),
    ({"air.ambient": "55 degC"}, "air.ambient", "below 49.17 degC, or the wire never extends"),
    ({"wire.heat_end": "130 degC"}, "wire.heat_end", "at most 119 degC under load"),
    ({"travel.low": "-1 mm"}, "travel.low", "a wire only contracts"),
    ({"travel.low": "0.1 mm"}, "travel.low", "where every run begins"),
    ({"travel.high": "4.2 mm"}, "travel.high", "at most 4.087 mm, wire.strain (0.04)"),
    ({"travel.high": "3 mm", "guard.high": "2 mm"}, "travel.high", "guard.high (2 mm)"),
    ({"guard.low": "1 mm"}, "guard.low", "at most 0 mm"),
    ({"motion.velocity": "0.01 m/s"}, "motion.velocity", "driver.current (1.05 A) heat"),
    ({"motion.velocity": "0.001 m/s"}, "motion.velocity", "at which the wire cools"),
    ({"encoder.high": "3 mm"}, "travel.high", "what the sensor shows"),
    ({"arrival.tolerance": "1 um"}, "arrival.tolerance", "1.5 um or more"),
    ({"timing.period": "20 ms"}, "timing.period", "ms for a loop of"),
    ({"guard.silent": "0.5 ms"}, "guard.silent", "timing.period (1 ms)"),
    ({"guard.stuck": "0.5 ms"}, "guard.stuck", "timing.period"),
    ({"guard.window": "0.5 ms"}, "guard.window", "timing.period"),
]


@pytest.mark.parametrize(("changes", "path", "words"), CASES)
def test_what_it_cannot_do_is_refused(changes, path, words):
    with pytest.raises(InputError) as error:
        DEFAULT.with_(changes)
    assert error.value.where.endswith(path)
    assert words in error.value.accepted


WIRE = machine.MACHINES[2]


def test_heats_follow_from_the_sheet():
    """0.25 mm, 100 mm: 31.7 mg by 6450 kg/m^3, 837 J/(kg K) and 24.2 kJ/kg."""
    found = wire_sheets.heats(DEFAULT)
    mass = 6450.0 * math.pi * 0.125e-3**2 * 0.1
    assert mass == pytest.approx(31.66e-6, rel=1e-3)
    assert found.capacity == pytest.approx(mass * 837.0)
    assert found.latent == pytest.approx(mass * 24.2e3)
    # From 98 to 62 degC in a room of 22 degC, the latent heat at 67 degC.
    time = found.resistance * (found.capacity * math.log(76.0 / 40.0) + found.latent / 45.0)
    assert time == pytest.approx(4.5)
    assert wire_sheets.power(DEFAULT) == pytest.approx(1.05**2 * 1.85)


def test_a_load_shifts_the_temperatures():
    """8 MPa/K: the printed ones hold at the printed pull, 172 to 178 MPa."""
    assert wire_sheets.shift_temperatures(DEFAULT, 8.74) == pytest.approx((88.0, 98.0, 72.0, 62.0))
    area = wire_sheets.area(DEFAULT)
    assert 8.74 / area == pytest.approx(172e6, rel=0.05)
    half = wire_sheets.shift_temperatures(DEFAULT, 8.74 - 8e6 * area)
    assert half == pytest.approx((87.0, 97.0, 71.0, 61.0))


def test_its_way_is_that_of_the_plant():
    """4 % of 100 mm, and what the martensite was stretched by less what the austenite is."""
    p = prepare(DEFAULT).micro
    x, force = alloys.geometry(p.wire, p.load, 1.0, 0.0)
    assert wire_sheets.way(DEFAULT) == pytest.approx(x)
    assert wire_sheets.pull(DEFAULT, 0.0) == 3.7
    assert force == pytest.approx(wire_sheets.pull(DEFAULT, x))
    assert wire_sheets.rate(DEFAULT) == pytest.approx(500.0 + 76.7, rel=1e-3)


def test_gains_follow_from_heat_and_way():
    law = DEFAULT.controller
    found = wire_sheets.heats(DEFAULT)
    # All of the way for the latent heat and a rise of 10 K, and what the load shifts meanwhile.
    shift = wire_sheets.rate(DEFAULT) * wire_sheets.way(DEFAULT) / (8e6 * wire_sheets.area(DEFAULT))
    per_joule = wire_sheets.way(DEFAULT) / (found.latent + found.capacity * (10.0 + shift))
    assert wire_sheets.per_joule(DEFAULT) == pytest.approx(per_joule)
    assert law.kp == pytest.approx(100.0 * 10.0 / (per_joule * 1.05**2 * 1.85), rel=1e-3)
    time_constant = found.capacity * found.resistance
    assert law.ki == pytest.approx(2.0 * law.kp / time_constant, rel=1e-3)
    assert law.ahead_velocity == pytest.approx(10.0 / (per_joule * 1.05**2 * 1.85), rel=1e-3)
    assert (law.low, law.high) == (0.0, 10.0)
    up, down = wire_sheets.speeds(DEFAULT)
    assert down == pytest.approx(per_joule * (49.17 - 22.0) / found.resistance, rel=1e-3)
    assert up > 5.0 * down
    assert DEFAULT.motion.velocity == pytest.approx(0.5 * down, rel=1e-3)
    assert DEFAULT.travel.high == pytest.approx(0.9 * wire_sheets.way(DEFAULT), rel=1e-3)
    assert DEFAULT.arrival.tolerance == pytest.approx(3e-6)
    slow = DEFAULT.with_("driver.lag", "20 ms")
    assert slow.controller.kp == pytest.approx(0.286 * law.kp, rel=1e-2)


def test_nothing_that_no_sheet_prints_is_known():
    other = DEFAULT.with_(
        {"hidden.capacity": 2.0, "hidden.latent": 2.0, "hidden.cooling": 2.0,
         "hidden.fold": "20 K", "hidden.scatter": "9 K"}
    )  # fmt: skip
    for name in ("timing", "travel", "motion", "arrival", "controller", "guard"):
        assert getattr(other, name) == getattr(DEFAULT, name)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_a_wire_cools_in_the_time_that_is_printed(path):
    """From nine tenths of its contraction to one tenth, switched off; within 15 %."""
    _, tree = machine.load(path)
    params, dt = KIND.prepare(tree), tree.timing.period
    heating = stage.drive(KIND, params, np.full(6000, 10.0), WIDE, dt).position
    hot = int(np.argmax(heating > 0.9 * heating[-1]))
    # The printed current is for one second; with the printed heats it takes up to four.
    assert 0.5 < hot * dt < 4.0
    cooling = np.r_[np.full(hot, 10.0), np.zeros(round(2.0 * tree.wire.cooling / dt))]
    x = stage.drive(KIND, params, cooling, WIDE, dt).position[hot:]
    assert int(np.argmax(x < 0.1 * x.max())) * dt == pytest.approx(tree.wire.cooling, rel=0.15)


def test_thicker_wires_are_stronger_and_slower():
    trees = [machine.load(path)[1] for path in EXAMPLES]
    assert len(trees) == 3
    pulls, speeds = [t.wire.pull for t in trees], [wire_sheets.speeds(t)[1] for t in trees]
    assert pulls == sorted(pulls)
    assert speeds == sorted(speeds, reverse=True)


@pytest.mark.parametrize(
    "changes",
    [
        {"hidden.capacity": 1.3, "hidden.cooling": 0.8, "hidden.scatter": "8 K"},
        {"hidden.latent": 1.2, "air.ambient": "30 degC"},
    ],
)
def test_a_wire_that_is_off_its_sheet_arrives_too(changes):
    tree = DEFAULT.with_(changes)
    usual = planning.usual(tree)
    done = runs.record(machine.named("wire", "test"), tree, usual)
    assert done.outcome.finished and done.outcome.fault is None
    r = done.recording
    held = r["phase"] == 2
    assert np.max(np.abs(r["target"] - r["true_position"])[held]) < 2e-3 * 10.0
    assert all(np.any(r["arrived"][r["move"] == k]) for k in range(len(usual.target)))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_a_wire_stays_at_its_target(path):
    """Contracting or extending to it: no hunting across the hysteresis, for 20 s each."""
    _, tree = machine.load(path)
    counts = np.floor(np.array([2.5e-3, 1.5e-3, 2e-3]) / tree.encoder.pitch)
    programme = planning.usual(tree)._replace(
        start=np.full(3, math.nan),
        stage=np.zeros(3, np.int64),
        target=counts,
        hold=np.full(3, 20.0),
    )
    r = runs.record(machine.named("wire", "test"), tree, programme).recording
    for k in range(3):
        error = (r["target"] - r["true_position"])[r["move"] == k][-10000:]
        assert np.abs(error).max() < 2e3 * tree.arrival.tolerance  # mm


def test_patience_grows_with_the_time_in_which_the_hysteresis_is_crossed():
    assert DEFAULT.arrival.patience == 10.0
    long = DEFAULT.with_({"wire.length": "300 mm", "bias.rate": "100 N/m", "encoder.high": "30 mm"})
    width = 26.0 / wire_sheets.heats(long).resistance / wire_sheets.power(long) * 10.0
    assert long.arrival.patience == pytest.approx(
        2.0 * width / (long.controller.ki * 3e-6), rel=1e-3
    )
    assert long.arrival.patience > 20.0
    assert long.with_("wire.length", "100 mm").arrival.patience == 10.0


def test_interpreted_and_compiled_agree():
    plan = planning.plan(planning.usual(DEFAULT), DEFAULT)
    stages, bench = (
        composite.stages(machine.MACHINES[2]),
        composite.bench(machine.MACHINES[2], DEFAULT),
    )
    loops = performing.loops(WIRE, DEFAULT, plan)
    noise = np.random.default_rng(1).standard_normal((300, KIND.noises))
    blocks = []
    for run in (period.period(stages), compiled(period.period(stages))):
        block = np.zeros((len(period.columns(stages)), len(noise)))
        begin = period.beginning(stages, bench, loops)
        run(bench, loops, begin, (noise,), block, DEFAULT.timing.period)
        blocks.append(block)
    assert np.allclose(*blocks, rtol=1e-12, atol=1e-18)
    assert np.ptp(blocks[0][1]) > 0.0


def test_all_settings_are_read_back_bit_for_bit(tmp_path):
    tree = DEFAULT.with_({"wire.length": "0.1234 m", "bias.rate": "321 N/m"})
    path = tmp_path / "m.toml"
    path.write_text(machine.as_toml(machine.MACHINES[2], tree), encoding="utf-8")
    assert machine.load(path)[1] == tree
