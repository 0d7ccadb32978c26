"""`identify actuator` from files: what it refuses, and a model.toml that a run takes."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.identify.test_wire_lags import record

from macromicro import api
from macromicro.control.inverse.model import Inverse
from macromicro.errors import InputError
from macromicro.hysteresis.table import FodTable
from macromicro.identify import kinds, model_file, wire_table
from macromicro.identify.kinds import actuator
from macromicro.identify.wire import WireFit
from macromicro.identify.wire_model import Wire
from macromicro.identify.wire_table import LawFit
from macromicro.models.stressed import simulate
from macromicro.settings import Settings, choose


def test_a_table_has_temperatures_of_its_own(tmp_path: Path) -> None:
    record(2e-3, 3e-3).save(tmp_path / "a.h5")
    with pytest.raises(InputError, match=r"^austenite: .*cannot be combined with --table"):
        kinds.from_files("actuator", tmp_path / "a.h5", table=tmp_path / "t.h5", austenite=80.0)


def test_all_gains_go_into_the_settings_file_and_come_back(tmp_path: Path) -> None:
    gains = Inverse()._replace(lag=1.23456789e-3, r2=0.21)
    (tmp_path / "model.toml").write_text(model_file.gains("A head", "fine", gains, "inverse"))
    tree = choose(Settings(), tmp_path / "model.toml", None)
    assert tree.controller.micro_law == "inverse"
    assert tree.controller.fine.lag == pytest.approx(1.23457e-3, rel=1e-9)
    assert tree.controller.fine.r2 == 0.21
    assert tree.controller.fine.relays == pytest.approx(gains.relays)


def test_gains_that_do_not_work_together_are_no_file() -> None:
    wrong = Inverse()._replace(r1=0.9)
    with pytest.raises(InputError, match=r"model\.toml, controller\.fine\.r1"):
        model_file.gains("A head", "fine", wrong, "inverse")


@pytest.mark.parametrize("sensor", [2.5e-3, math.nan])
def test_what_was_found_is_told(tmp_path: Path, monkeypatch, sensor: float) -> None:
    """The search itself is tested in test_wire_lags."""
    from macromicro.control.inverse.model import prepare

    seen = {}
    names = (*actuator.MEANINGS, "heat 1.5 V")
    model, table = Wire(prepare(Inverse()).model), FodTable(0.0, 1.0, np.eye(2, k=-1), 0.0)
    fit = WireFit(model, table, dict.fromkeys(names, 1.0), dict.fromkeys(names, 0.1), 0.012, 7)

    def found(table, records, ambient):
        seen.update(table=table, records=records, ambient=ambient)
        return LawFit(fit, sensor, Inverse())

    monkeypatch.setattr(wire_table, "for_law", found)
    monkeypatch.setattr("macromicro.identify.kiln.saved_table", lambda path: "the table")
    record(2e-3, 3e-3).save(tmp_path / "a.h5")
    result = kinds.from_files("actuator", tmp_path / "a.h5", table=tmp_path / "t.h5", ambient=21.0)
    assert (seen["table"], seen["ambient"]) == ("the table", 21.0)
    (one,) = seen["records"]
    original = record(2e-3, 3e-3)
    assert one["laser"] == pytest.approx(original["laser"])
    assert one.dt == pytest.approx(1e-3) and "hall_voltage" in one and "contract" not in one
    lines = {line.name: line for line in result.lines}
    assert lines["c1"].error == 0.1 and lines["heat 1.5 V"].unit == "K"
    assert lines["lag"].value == Inverse().lag
    assert ("sensor" in lines) == math.isfinite(sensor)
    assert ("sensor's lag" in dict(result.remarks)) == math.isnan(sensor)
    assert 'micro_law = "inverse"' in result.toml
    assert set(result.draw()) == {"free_run", "residuals", "heat"}
    record(2e-3, 3e-3).save(tmp_path / "b.h5")
    judged = kinds.from_files(
        "actuator", tmp_path / "a.h5", table=tmp_path / "t.h5", tests=(str(tmp_path / "b.h5"),)
    )
    free = simulate(model.wires, original["ctrl"], original.dt, math.nan)[0]
    missed = 1e-3 * np.asarray(original["laser"]) - free
    assert judged.data["tests"][0]["rms"] == pytest.approx(float(np.sqrt(np.mean(missed**2))))
    titles = [axes.get_title("left") for axes in judged.draw()["free_run"].axes]
    assert titles[:2] == ["fitted", "not fitted: b.h5"] and "test" in [
        line.name for line in judged.lines
    ]


@pytest.mark.slow
def test_its_commands_lead_from_the_bench_to_a_run(tmp_path: Path) -> None:
    def told(*words: str) -> None:
        command = [sys.executable, "-m", "macromicro", *words]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    k, t, a, m = (str(tmp_path / name) for name in "ktam")
    told("collect", "kiln", "--out", k)
    told("identify", "hysteresis", f"{k}/cycles.h5", "--shape", "nonnegative", "--out", t)
    told("collect", "actuator", "--out", a)
    told("identify", "actuator", f"{a}/held.h5", f"{a}/quick.h5", "--table", f"{t}/table.h5",
         "--out", m)  # fmt: skip
    (tmp_path / "p.toml").write_text('[[moves]]\nmicro = ["2 mm", "1 mm"]\nhold = "1.5 s"\n')
    tree = choose(Settings(), Path(m) / "model.toml", None)
    run = api.run(tmp_path / "p.toml", settings=tree)
    assert abs(run["true_micro"][1400] - 2.0) < 2e-3 and abs(run["true_micro"][-1] - 1.0) < 2e-3
