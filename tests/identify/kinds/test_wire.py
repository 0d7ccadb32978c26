"""`identify actuator` without a table: columns, units, what is told."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.identify.kinds.seen import table
from tests.identify.test_wire import DT, foreign, levels, own

from macromicro.errors import InputError
from macromicro.identify import kinds, wire
from macromicro.identify.wire import WireFit


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    made = []
    for seed in (1, 3):
        one = foreign(levels(seed, 600), seed)
        t = np.arange(600) * DT
        made.append(table(tmp_path / f"{seed}.csv", "t_s,u_A,x_mm", t, one.u, one.x))
    return made


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list:
    """The search itself is tested in test_wire."""
    seen = []

    def found(records, ambient, austenite):
        seen.append((records, ambient, austenite))
        known = wire._Scale(wire._nodes(records[0].u), ambient, austenite, 2.0, 0.0)
        model, relays, values = wire._wire(known, own(known)[0])
        std = dict.fromkeys(values, 0.1) | {"latent": math.nan}
        return WireFit(model, relays, values, std, 0.02, 9)

    monkeypatch.setattr(wire, "without_table", found)
    return seen


def test_what_was_found_is_told(files: list[Path], asked: list) -> None:
    found = kinds.from_files("actuator", files[0], tests=(str(files[1]),))
    records, ambient, austenite = asked[0]
    assert (len(records), ambient, austenite) == (1, 25.0, 80.0)
    lines = {line.name: line for line in found.lines}
    assert lines["wire"].unit == "s" and lines["latent"].unit == "K"
    heat = next(name for name in lines if name.startswith("heat "))
    assert lines[heat].note == "final warming of the wires by so many A"
    assert "not fitted" in lines["test"].note
    said = dict(found.remarks)
    extent = float(np.ptp(records[0].x))
    assert said["fit"] == f"20 um RMS, {2.0 / extent:.2f} % of the range, 1 records"
    assert said["scale of temperature"].startswith("half contracted at 80 degC")
    share = 100.0 * found.data["tests"][0]["rms"] / extent
    assert said["test records"] == f"{share:.2f} % of the range at most"
    drawn = found.plot()
    assert set(drawn) == {"free_run", "residuals", "branches", "heat"}
    told = tomllib.loads(found.toml)["actuator"]
    assert told[heat.replace(" ", "_").replace(".", "p")] == pytest.approx(lines[heat].value)
    assert "test" not in told


def test_scale_and_room_are_as_given(files: list[Path], asked: list) -> None:
    kinds.from_files("actuator", files[0], ambient=20.0, austenite=95.0)
    assert asked[0][1:] == (20.0, 95.0)


def test_a_switch_takes_the_drive_away(tmp_path: Path, asked: list) -> None:
    one = foreign(levels(1, 600), 1)
    t, cut = np.arange(600) * DT, (np.arange(600) > 300) * 1.0
    path = table(tmp_path / "c.csv", "t_s,u_A,x_mm,c", t, one.u, one.x, cut)
    kinds.from_files("actuator", path)
    drive = asked[0][0][0].u
    assert np.all(drive[301:] == 0.0)
    assert np.all(drive[:301] == one.u[:301])


def test_a_record_of_a_few_samples_is_refused(tmp_path: Path, asked: list) -> None:
    t = np.arange(49) * DT
    path = table(tmp_path / "a.csv", "t_s,u_A,x_mm", t, t, t)
    with pytest.raises(InputError, match="50 samples or more"):
        kinds.from_files("actuator", path)
