"""Records of machines of one stage, and what is identified from them."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro import cli, identify
from macromicro.commission import _exciting, collecting
from macromicro.commission._probing import CommissionError
from macromicro.commission.collecting import Given
from macromicro.errors import InputError
from macromicro.machines import machine as machines
from macromicro.machines import planning, runs, sheets, wire_sheets
from macromicro.machines import rig as machine_rig
from macromicro.machines.rig import Twin
from macromicro.recording import Recording

EXAMPLES = Path(__file__).parents[2] / "examples" / "machines"


def given(name: str, tree: Any = None, **rest: Any) -> Given:
    machine = machines.named(name, "")
    assert machine is not None
    return Given(machine, machine.settings if tree is None else tree, rest.get("rig"), 0)


@pytest.fixture(scope="module")
def record() -> Recording:
    return collecting.find("drive", given("axis").machine).collect(given("axis"), lambda: False)


@pytest.mark.slow
def test_the_mass_of_an_axis_is_found_from_its_strokes(record: Recording, tmp_path: Path) -> None:
    tree = given("axis").tree
    record.save(tmp_path / "drive.h5")
    found = identify.from_files("drive", str(tmp_path / "drive.h5"))
    mass = found.lines[0]
    assert abs(mass.value - sheets.mass(tree)) < mass.half < 0.02 * mass.value
    # In SI, for the file says what a volt pushes with.
    assert found.model.coulomb == pytest.approx(tree.friction.coulomb, rel=0.05)


@pytest.mark.slow
def test_the_inertia_of_an_axis_that_turns_is_found_in_its_own_units(tmp_path: Path) -> None:
    one = given("rotary")
    taken = collecting.find("drive", one.machine).collect(one, lambda: False)
    assert {c.name: c.unit for c in taken.columns} == {"t": "s", "u": "V", "x": "rad"}
    assert one.tree.travel.low <= taken["x"].min() and taken["x"].max() <= one.tree.travel.high
    taken.save(tmp_path / "drive.h5")
    found = identify.from_files("drive", str(tmp_path / "drive.h5"))
    assert found.model.mass == pytest.approx(sheets.mass(one.tree), rel=0.03)
    assert found.model.coulomb == pytest.approx(one.tree.friction.coulomb, rel=0.05)
    units = {line.name: line.unit for line in found.lines}
    assert units["mass"] == "kg*m^2" and units["viscous"] == "N*m*s/rad"
    model = tmp_path / "model.toml"
    model.write_text(found.to_toml(), encoding="utf-8")
    machine, tree = machines.load(model)
    assert machine.name == "rotary" and tree.load.inertia == pytest.approx(found.model.mass)
    done = runs.record(machine, tree, planning.usual(tree))
    assert done.outcome.fault is None and done.outcome.finished
    # Its friction is elastic before it slides: intervals hold for a model that has this.
    elastic = identify.from_files("drive", str(tmp_path / "drive.h5"), structure="lugre")
    lines = {line.name: line for line in elastic.lines}
    for name, true in (("mass", sheets.mass(one.tree)), ("coulomb", one.tree.friction.coulomb)):
        assert abs(lines[name].value - true) < lines[name].half < 0.02 * true


def test_the_strokes_stay_within_the_travel_and_what_the_motor_gives(record: Recording) -> None:
    tree = given("axis").tree
    assert {c.name: c.unit for c in record.columns} == {"t": "s", "u": "V", "x": "m"}
    x, u = record["x"], record["u"]
    assert tree.travel.low <= x.min() and x.max() <= tree.travel.high
    assert x.max() - x.min() > 0.3 * (tree.travel.high - tree.travel.low)
    full = sheets.force(tree) * sheets.per_newton(tree)
    assert 0.6 * full < np.max(np.abs(u)) < 0.7 * full
    speed = np.diff(x) / record.dt
    # So the current of no braking is limited: its volts are those of effort and back-EMF.
    emf = speed * tree.controller.ahead_velocity
    assert np.max(np.abs(u[1:] - emf)) < full
    assert np.all(np.diff(record["t"]) == pytest.approx(record.dt))


def test_another_rig_of_the_machine_gives_the_same_record(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_exciting, "STROKES", 2)
    mine = given("axis")
    one = collecting.strokes(mine)
    other = collecting.strokes(mine._replace(rig=Twin(mine.machine.kind, mine.tree)))
    assert len(other) == len(one) and np.allclose(other["x"], one["x"], atol=1e-5)


def test_a_weight_that_runs_away_is_refused() -> None:
    tree = machines.load(EXAMPLES / "screw.toml")[1]
    with pytest.raises(CommissionError, match="weight"):
        collecting.strokes(given("axis", tree))


def test_whoever_wants_it_to_end_ends_it() -> None:
    with pytest.raises(KeyboardInterrupt):
        collecting.strokes(given("axis"), lambda: True)


def test_the_loop_of_a_piezo_stage_is_found_from_ramps(tmp_path: Path) -> None:
    mine = given("piezo")
    made = collecting.find("", mine.machine).collect(mine, lambda: False)
    made.save(tmp_path / "plays.h5")
    assert made["u"].min() > mine.tree.amplifier.low and made["u"].max() < mine.tree.amplifier.high
    found = identify.from_files("plays", str(tmp_path / "plays.h5"))
    stack = mine.tree.stack
    gain = (made["f"].max() - made["f"].min()) / np.ptp(made["u"])
    assert gain == pytest.approx(1e6 * stack.stroke / stack.span, rel=0.1)
    values = {line.name: line.value for line in found.lines}
    assert values["loop width"] == pytest.approx(100.0 * stack.hysteresis, rel=0.15)
    assert values["prediction"] < 0.3  # % of the range, of what was held out


@pytest.mark.parametrize(
    ("name", "experiment", "words"),
    [("axis", "plays", "drive for this machine"), ("wire", "drive", "curves for this machine")],
)
def test_an_experiment_of_another_machine_is_refused(
    name: str, experiment: str, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        collecting.find(experiment, given(name).machine)


def test_the_command(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def called(*words: str) -> int:
        monkeypatch.setattr(sys, "argv", ["macromicro", *words])
        return cli.main()

    file = str(EXAMPLES / "piezo-100um.toml")
    assert called("collect", "--list", "--config", file) == 0
    assert capsys.readouterr().out.startswith("plays ")
    assert called("collect", "plays", "--config", file, "--out", str(tmp_path / "a")) == 0
    said = capsys.readouterr().out
    assert f"then: macromicro identify plays {tmp_path}/a/plays.h5" in said
    assert len(Recording.load(tmp_path / "a" / "plays.h5")) > 100
    assert called("collect", "drive", "--config", file) == 2


SLOW = 20.0


@pytest.fixture(scope="module")
def contraction() -> Iterator[Recording]:
    """Three times as quick as the command, for the clock's sake."""
    mine = given("wire")
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(collecting, "SLOW", SLOW)
        yield collecting.find("", mine.machine).collect(mine, lambda: False)


@pytest.mark.slow
def test_curves_of_a_wire_are_those_of_its_sheet(contraction: Recording, tmp_path: Path) -> None:
    """Its way, its loop from the sheet's temperatures, and a table that repeats its own curves."""
    tree = given("wire").tree
    contraction.save(tmp_path / "curves.h5")
    u, f = contraction["u"], contraction["f"]
    way = 1e6 * wire_sheets.way(tree)
    assert np.ptp(f) == pytest.approx(way, rel=0.03)
    volts = tree.driver.full_scale / (wire_sheets.power(tree) * wire_sheets.heats(tree).resistance)

    def half(rows: Any) -> float:
        """Effort at half the way."""
        return float(u[rows][np.argmin(np.abs(f[rows] - 0.5 * way))])

    top = int(np.argmax(np.diff(u) < 0.0))  # heating first, from cold; then all the way down
    low = top + int(np.argmax(np.diff(u[top:]) > 0.0))
    load = wire_sheets.pull(tree, 0.5 * wire_sheets.way(tree))
    at = wire_sheets.shift_temperatures(tree, load)
    wide = volts * (at.heat_start + at.heat_end - at.cool_start - at.cool_end) / 2.0
    late = 2.0 * (u.max() - u[low]) / SLOW  # heat lags behind by one time constant
    assert half(slice(0, top)) - half(slice(top, low)) == pytest.approx(wide + late, rel=0.08)
    found = identify.from_files("hysteresis", str(tmp_path / "curves.h5"), shape="free")
    values = {line.name: line.value for line in found.lines}
    assert values["misfit"] < 2.0 and values["wiping-out"] < 1.0  # % of the range
    assert values["output, high"] == pytest.approx(way, rel=0.03)


def test_each_curve_turns_elsewhere_and_comes_back_to_the_top(contraction: Recording) -> None:
    u = contraction["u"]
    step = np.sign(np.diff(u))
    moving = step[step != 0.0]
    rows = np.flatnonzero(step != 0.0)[np.flatnonzero(np.diff(moving) > 0.0)]
    turns = u[rows]
    assert len(turns) == 1 + len(collecting.TURNS)  # the large loop, then one after another
    assert np.all(np.diff(turns[1:]) < 0.0)
    shares = (u.max() - turns) / (u.max() - turns[0])
    assert shares[1:] == pytest.approx(collecting.TURNS, abs=0.01)
    slow = float(np.abs(np.diff(u)).max()) / contraction.dt
    heats = wire_sheets.heats(given("wire").tree)
    tau = heats.resistance * heats.capacity
    assert slow * tau < 0.05 * (u.max() - turns[0])


@pytest.mark.slow
def test_a_rig_of_a_wire_gives_its_curves_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same efforts, given period by period; who interrupts it ends it."""
    monkeypatch.setattr(collecting, "SLOW", 0.5)
    mine = given("wire")
    compiled = collecting.curves(mine)
    rig = machine_rig.CompiledTwin(mine.machine.kind, mine.tree, 0)
    made = collecting.curves(mine._replace(rig=rig))
    n = min(len(made), len(compiled)) - 1
    assert np.allclose(made["u"][:n], compiled["u"][:n])
    assert made["f"][:n] == pytest.approx(compiled["f"][:n], abs=60.0)
    rig = machine_rig.CompiledTwin(mine.machine.kind, mine.tree, 0)
    with pytest.raises(KeyboardInterrupt):
        collecting.curves(mine._replace(rig=rig), lambda: True)
