"""`identify drive --machine`: a data sheet's machine with what was identified."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from macromicro import identify
from macromicro.errors import InputError
from macromicro.identify import Axis, Result, simulate
from macromicro.machines import identified, sheets
from macromicro.machines import machine as machines

SHEET = """\
machine = "axis"

[amplifier]
supply = "24 V"
current = "1.2 A"

[motor]
constant = "23.4 mN*m/A"
resistance = "2.32 ohm"
inductance = "0.238 mH"
inertia = "10.8e-7 kg*m^2"

[drive]
kind = "screw"
lead = "2 mm"

[load]
mass = "0.8 kg"
stop_low = "-2 mm"
stop_high = "52 mm"
"""
LOAD, VISCOUS, COULOMB = 1.5, 40.0, 9.0


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sheet")
    (folder / "axis.toml").write_text(SHEET)
    return folder


@pytest.fixture(scope="module")
def found(place: Path) -> Result:
    """From a record of the sheets' motor, at low efforts, on a load that differs from theirs."""
    tree = machines.load(place / "axis.toml")[1]
    push, winding = sheets.constant(tree) * tree.drive.efficiency, tree.motor.resistance
    back = push * sheets.constant(tree) / winding
    truth = Axis(sheets.turning(tree) + LOAD, VISCOUS + back, COULOMB)
    random = np.random.default_rng(2)
    efforts = np.repeat(random.uniform(-2.0, 2.0, 25), 150)
    x = simulate(truth, efforts / sheets.per_newton(tree), 1e-3)
    x = 1e-7 * np.round(x / 1e-7)
    t = 1e-3 * np.arange(len(efforts))
    rows = np.c_[t, efforts, 1e3 * x]
    np.savetxt(place / "own.csv", rows, "%.8g", ",", header="t_s,u_V,x_mm", comments="")
    gain = 1.0 / sheets.per_newton(tree)
    return identify.from_files("drive", place / "own.csv", structure="coulomb", gain=gain)


def test_the_sheets_limits_stay_and_what_was_identified_is_merged(
    place: Path, found: Result
) -> None:
    text = identified.merge(found, identified.sheet(place / "axis.toml"))
    (place / "model.toml").write_text(text)
    before, after = (machines.load(place / f"{n}.toml")[1] for n in ("axis", "model"))
    for name in ("amplifier", "motor", "drive", "travel", "encoder"):
        assert getattr(after, name) == getattr(before, name)
    assert after.load.stop_high == before.load.stop_high
    assert after.load.mass == pytest.approx(LOAD, rel=0.05)
    assert after.friction.coulomb == pytest.approx(COULOMB, rel=0.05)
    assert after.friction.viscous == pytest.approx(VISCOUS, rel=0.2)
    lines = {line.partition(" = ")[0]: line for line in text.splitlines()}
    assert "# identified, +- " in lines["mass"] and 'had "0.8 kg"' in lines["mass"]
    assert lines["supply"].endswith("axis.toml") and "# as in" in lines["supply"]


def test_a_machine_of_a_record_says_what_is_its_range_and_what_is_assumed(found: Result) -> None:
    lines = {line.partition(" = ")[0]: line for line in found.to_toml().splitlines()}
    assert lines["supply"].endswith("# range of the records, not the machine's limit")
    assert lines["high"].endswith("# range of the records, not the machine's limit")
    assert lines["resistance"].endswith("# assumed, not identified")
    assert lines["coulomb"].endswith("# identified")
    said = dict(found.remarks)
    assert "--machine" in said["limits of the machine"] and "resistance" in said["assumed"]


def test_a_sheet_that_weighs_more_than_was_identified_is_refused(
    place: Path, found: Result
) -> None:
    heavy = SHEET.replace("10.8e-7", "10.8e-5")
    (place / "heavy.toml").write_text(heavy)
    with pytest.raises(InputError, match=r"heavy.toml, load.mass.*motor, drive and payload"):
        identified.merge(found, identified.sheet(place / "heavy.toml"))
    (place / "piezo.toml").write_text('machine = "piezo"\n')
    with pytest.raises(InputError, match=r"piezo.toml, machine: 'piezo'; accepted: axis or rotary"):
        identified.sheet(place / "piezo.toml")
