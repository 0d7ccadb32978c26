"""Modes of the structure from a chirp: an axis of known mode, a stiff one, and what follows."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from macromicro.commission import _axis_fit, _axis_page, _exciting, _mode
from macromicro.commission import _settings as found_settings
from macromicro.commission._mode import Mode, Shape
from macromicro.commission._probing import Direction, Ends
from macromicro.commission.stand import Caution, Record, Stand
from macromicro.errors import InputError
from macromicro.identify import axis_settings
from macromicro.identify.axis_settings import Around
from macromicro.machines import deriving, loops, rig, sheets
from macromicro.machines import machine as machines
from macromicro.machines.parts import LOAD, MOTOR
from macromicro.models.mass import Axis
from macromicro.rig.session import Session
from macromicro.schema import config
from macromicro.schema.text import parsed_toml

HELD = 30.0  # Hz


def belt(at: str, frequency: float = HELD) -> tuple[Any, Any]:
    """A carriage on a belt, and its settings."""
    machine = machines.named("axis", "machine")
    assert machine is not None
    table = {
        "motor.inertia": "4e-6 kg*m^2",
        "motor.inductance": "0.2 mH",
        "drive.radius": "5 mm",
        "drive.inertia": "4e-6 kg*m^2",
        "drive.frequency": f"{frequency} Hz",
        "drive.damping": 0.03,
        "load.mass": "0.5 kg",
        "load.stop_high": "205 mm",
        "encoder.at": at,
        "encoder.lines": 2000.0,
        "encoder.pitch": "4 um",
    }
    return machine, config.overridden(machine.settings, table, "a belt")


def passes(at: str, frequency: float = HELD) -> tuple[Any, list[Record]]:
    machine, tree = belt(at, frequency)
    friction = sheets.per_newton(tree) * (tree.friction.coulomb + tree.friction.stribeck)
    found, ends = Direction(1.0, friction, friction, 0.0, 1.0), Ends(0.0, 0.2, False)
    caution = Caution(8.0, 0.6, -0.005, 0.205)
    dt = tree.timing.period
    with Session(rig.CompiledTwin(machine.kind, tree, 0), dt) as session:
        stand = Stand(session, dt, tree.encoder.pitch)
        about = _axis_fit.momentum(_exciting.excite(stand, found, ends, caution, 0.1), dt)
        return tree, _exciting.shaken(stand, about, found, ends, caution, 0.1)


@pytest.fixture(scope="module")
def inner() -> tuple[Any, list[Record], Mode]:
    tree, made = passes(MOTOR)
    seen = _mode.find_mode(made, tree.timing.period)
    assert seen is not None
    return tree, made, seen


@pytest.fixture(scope="module")
def outer() -> tuple[Any, Mode]:
    tree, made = passes(LOAD)
    seen = _mode.find_mode(made, tree.timing.period)
    assert seen is not None
    return tree, seen


def resonance(tree: Any) -> float:
    rotor, load = sheets.turning(tree), tree.load.mass
    return float(tree.drive.frequency * math.sqrt((rotor + load) / rotor))


def test_in_front_of_the_drive_both_frequencies_are_found(
    inner: tuple[Any, list[Record], Mode],
) -> None:
    tree, _, seen = inner
    assert seen.found and seen.shape.at == MOTOR
    truth = {"resonance": resonance(tree), "antiresonance": HELD, "damping": 0.03}
    for name in ("resonance", "antiresonance"):
        assert seen.values[name] == pytest.approx(truth[name], rel=0.03)
    for name, value in truth.items():
        assert abs(seen.values[name] - value) < 1.96 * seen.errors[name]
        assert seen.errors[name] < (0.5 if name == "damping" else 0.03) * seen.values[name]
    per_newton = sheets.per_newton(tree)
    assert 1.0 / seen.gain == pytest.approx(per_newton * sheets.mass(tree), rel=0.05)
    late = tree.timing.delay + tree.motor.inductance / tree.motor.resistance
    assert abs(seen.values["lag"] - late) < 1.96 * seen.errors["lag"]


def test_behind_the_drive_the_resonance_is_found(outer: tuple[Any, Mode]) -> None:
    tree, seen = outer
    assert seen.found and seen.shape.at == LOAD
    assert seen.shape.resonance == pytest.approx(resonance(tree), rel=0.03)
    assert abs(seen.shape.resonance - resonance(tree)) < 1.96 * seen.errors["resonance"]
    assert set(seen.errors) == {"resonance", "lag"}
    assert seen.shape.rotor == pytest.approx(0.5)
    assert any("no antiresonance" in said for said in _axis_page.mode_doubts(seen, 1e-3))


def test_passes_slide_all_the_time_and_stay_in_the_window(
    inner: tuple[Any, list[Record], Mode],
) -> None:
    _, made, _ = inner
    assert len(made) == _exciting.PASSES
    ways = []
    for one in made:
        assert one.x.min() > 0.0 and one.x.max() < 0.2
        way = one.x[-1] - one.x[0]
        ways.append(way > 0.0)
        back = np.diff(one.x[::20]) * math.copysign(1.0, way)
        assert (back > 0.0).mean() > 0.97
    assert ways == [True, True, False, False] * (_exciting.PASSES // 4)
    # The chirp of the second of a pair has the other sign.
    quick = [np.diff(one.u, 2) for one in made]
    assert np.corrcoef(quick[0], quick[1])[0, 1] < -0.5


def test_the_response_is_that_of_the_data_sheets(inner: tuple[Any, list[Record], Mode]) -> None:
    tree, dt = inner[0], 1e-3
    tree = tree._replace(
        friction=tree.friction._replace(viscous=0.0), timing=tree.timing._replace(period=dt)
    )
    mass, per_newton = sheets.mass(tree), sheets.per_newton(tree)
    emf = sheets.constant(tree) / tree.amplifier.gain
    rotor = sheets.turning(tree) / mass
    f = np.array([6.0, 20.0, 30.0, 41.0, 90.0])
    winding = tree.motor.inductance / tree.motor.resistance
    for at in (MOTOR, LOAD):
        shape = Shape(
            emf / (per_newton * mass), tree.timing.delay, winding,
            HELD / math.sqrt(rotor), math.sqrt(rotor), 0.03, at,
        )  # fmt: skip
        z = np.exp(2j * math.pi * f * dt)
        there = tree._replace(encoder=tree.encoder._replace(at=at))
        sheet = sheets.plant(there, f) * (z - 1.0) / dt
        mine = _mode.response(shape, f, dt) / (per_newton * mass)
        assert np.abs(mine / sheet - 1.0).max() < 0.02  # a sheet has no aliases
        assert np.abs(mine / sheet - 1.0)[0] < 2e-3


def test_the_poles_are_those_of_the_response() -> None:
    shape = Shape(30.0, 0.0, 5e-4, 60.0, 0.6, 0.04)
    for p in _mode.poles(shape):
        drag, _ = sheets.impedance(
            np.array([p]), rotor=shape.rotor, moved=1.0 - shape.rotor, viscous=0.0,
            frequency=shape.held, damping=shape.damping,
        )  # fmt: skip
        assert abs(drag[0] * (1.0 + shape.rise * p) + shape.drag) < 1e-6 * abs(drag[0])
    stiff = np.sort(_mode.poles(Shape(30.0, 0.0, 5e-4)).real)
    assert stiff == pytest.approx(np.sort(np.roots([5e-4, 1.0, 30.0])))


def rung(shape: Shape, count: int = 8, noise: float = 1e-7) -> list[Record]:
    """Passes of a linear axis that answers a chirp by its impulse response."""
    dt, n = 1e-3, 1000
    t = np.arange(n) * dt
    f = np.fft.rfftfreq(4 * n, dt)
    f[0] = 1e-6
    whole = _mode.response(shape, f, dt)
    random = np.random.default_rng(3)
    made = []
    for k in range(count):
        rate = math.log(90.0) / t[-1]
        u = (1.0 - 2.0 * (k % 2)) * np.sin(2.0 * math.pi * 5.0 * np.exp(rate * t) / rate)
        v = np.fft.irfft(np.fft.rfft(u, 4 * n) * whole)[:n]
        x = np.concatenate([[0.0], np.cumsum(v[:-1]) * dt]) + noise * random.standard_normal(n)
        made.append(Record(t, u, x))
    return made


def test_a_stiff_axis_has_no_mode_and_a_weak_one_is_found() -> None:
    stiff = _mode.find_mode(rung(Shape(20.0, 4e-4, 3e-4)), 1e-3)
    assert stiff is not None and not stiff.found and stiff.errors == {}
    said = _axis_page.mode_doubts(stiff, 1e-3)
    assert len(said) == 1 and said[0].startswith("No mode")
    assert "Neither" in _axis_page.mode_doubts(stiff._replace(left=1e3), 1e-3)[0]
    weak = _mode.find_mode(rung(Shape(20.0, 4e-4, 3e-4, 120.0, 0.93, 0.03)), 1e-3)
    assert weak is not None and weak.found and weak.shape.at == MOTOR
    assert weak.shape.resonance == pytest.approx(120.0, rel=0.01)
    assert weak.shape.held == pytest.approx(0.93 * 120.0, rel=0.01)


@pytest.mark.slow
def test_an_antiresonance_at_the_resonance_is_no_mode() -> None:
    """Such a pair takes itself away: it would slow the gains down for nothing."""
    said = [
        _mode.find_mode(rung(Shape(20.0, 4e-4, 3e-4, 40.0, ratio, 0.01)), 1e-3)
        for ratio in (0.99, 0.97)
    ]
    assert [one is not None and one.found for one in said] == [False, True]


def test_what_shows_nothing_is_no_stiff_axis() -> None:
    random = np.random.default_rng(5)
    t = np.arange(1400) * 1e-3
    made = [Record(t, np.sin(50.0 * t * t), random.standard_normal(1400)) for _ in range(6)]
    assert _mode.find_mode(made, 1e-3) is None
    assert _mode.find_mode(made[:2], 1e-3) is None
    assert "are unknown" in _axis_page.mode_doubts(None, 1e-3)[0]
    _axis_page.bode(None)


AROUND = Around(1.0, 8.0, 5e-6, 1e-3, 0.2, 0.8)
FOUND = Axis(0.2, 4.0, 0.6, 0.1, 0.0, 0.1, 0.01, 6e-4)


def read(values: dict[str, str], name: str = "axis") -> Any:
    table = parsed_toml(axis_settings.as_toml(values, "", name), "text")
    table.pop(config.MACHINE)
    machine = machines.named(name, "machine")
    assert machine is not None
    return config.overridden(machine.settings, table, "text")


def as_mode(shape: Shape) -> Mode:
    empty = np.empty(0)
    return Mode(shape, 5.0, {"resonance": 0.5}, 1.0, (5.0, 450.0), empty, empty, empty, empty)  # type: ignore[arg-type]


def test_the_machine_s_file_has_the_mode_and_a_notch_that_makes_it_quicker() -> None:
    stiff = axis_settings.values(FOUND, AROUND)
    shape = Shape(20.0, 3e-4, 3e-4, 60.0, 0.6, 0.04, MOTOR)
    values = found_settings.with_mode(stiff, as_mode(shape), 1e-3)
    tree, plain = read(values), read(stiff)
    assert tree.drive.frequency == pytest.approx(36.0) and tree.drive.damping == 0.04
    assert resonance(tree) == pytest.approx(60.0)
    assert tree.encoder.at == MOTOR
    for same in (sheets.mass, sheets.constant, sheets.per_newton, sheets.weight, sheets.lag):
        assert same(tree) == pytest.approx(same(plain), rel=1e-9)
    slow = np.array([0.5])
    assert sheets.plant(tree, slow) == pytest.approx(sheets.plant(plain, slow), rel=2e-3)
    assert tree.controller.notch.frequency == 60.0
    # The gains are capped by the mode, and by less under the notch.
    bare = read({k: v for k, v in values.items() if k != found_settings.NOTCH})
    rates = [deriving.bandwidth(t) for t in (bare, tree, plain)]
    assert 1.1 * rates[0] < rates[1] < rates[2]
    turned = read(axis_settings.as_rotary(values), "rotary")
    f = np.array([3.0, 36.0, 61.0, 200.0])
    level = tree._replace(load=tree.load._replace(incline=0.0))
    assert sheets.plant(turned, f) == pytest.approx(sheets.plant(level, f), rel=1e-6)


def test_a_mode_too_quick_for_the_period_is_only_taken_out_of_the_effort() -> None:
    stiff = axis_settings.values(FOUND, AROUND)
    quick = as_mode(Shape(20.0, 3e-4, 3e-4, 200.0, 0.6, 0.04, LOAD))
    tree = read(found_settings.with_mode(stiff, quick, 1e-3))
    assert tree.drive.frequency == 0.0 and tree.controller.notch.frequency == 200.0
    assert any("too fast" in said for said in _axis_page.mode_doubts(quick, 1e-3))
    named = {**axis_settings.limber(stiff, axis_settings.Drive(0.36, 120.0, 0.04, LOAD))}
    with pytest.raises(InputError, match="a tenth of a period"):
        read(named)
    assert loops.NO_NOTCH.frequency == 0.0
