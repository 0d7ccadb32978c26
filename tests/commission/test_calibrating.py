"""The last step of a commissioning: a calibration on the rig as it stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.command import command

from macromicro.commission import calibrating
from macromicro.commission._verifying import Shifted
from macromicro.commission.calibrating import ReferencedTwin
from macromicro.commission.stand import Stand
from macromicro.machines import compositions, rig
from macromicro.rig.session import Session
from macromicro.types import SAFE

SCREW = """machine = "axis"
[drive]
kind = "screw"
error = "20 um"
error_period = "5 mm"
[friction]
coulomb = "5 N"
[encoder]
at = "motor"
lines = 1000
[load]
stop_high = "17 mm"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "axis.toml"
    made.write_text(SCREW, encoding="utf-8")
    return made


def test_a_twin_knows_its_true_position_compiled_or_not(file: Path) -> None:
    machine, settings = compositions.load(file)
    twins = [made(machine.kind, settings, 3) for made in (rig.Twin, rig.CompiledTwin)]
    for twin in twins:
        for _ in range(300):
            twin.read()
            twin.write(SAFE._replace(motor=1.0))
            twin.clock.wait(twin.dt)
    assert twins[0].true_position() == twins[1].true_position() != 0.0


def test_an_instrument_shows_the_true_position_with_its_noise(file: Path) -> None:
    machine, settings = compositions.load(file)
    twin = ReferencedTwin(machine.kind, settings, 3)
    errors = []
    for _ in range(500):
        errors.append(twin.read().laser - twin.true_position())
        twin.write(SAFE._replace(motor=1.0))
        twin.clock.wait(twin.dt)
    assert "laser" in twin.channels
    assert 0.08e-6 < np.std(errors) < 0.15e-6


@pytest.mark.slow  # a rig's periods are not compiled
def test_a_stage_is_calibrated_from_where_it_stands(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(calibrating, "POSITIONS", 12)
    machine, settings = compositions.load(file)
    asked: list[tuple[str, str]] = []
    done: list[str] = []
    with Session(ReferencedTwin(machine.kind, settings, 1), 1e-3) as session:
        stand = Stand(session, 1e-3, float(settings.encoder.pitch))
        assert stand.position() == 0.0
        found = calibrating.calibrate(
            machine,
            settings,
            (Shifted(stand),),
            seed=1,
            ask=lambda title, intent: asked.append((title, intent)),
            done=done.append,
        )
    ((title, intent),) = asked
    assert done == [title] == ["calibration"] and "12 positions" in intent
    assert found.settings.correction.period == pytest.approx(5e-3)
    assert np.hypot(*found.settings.correction.waves[:2]) == pytest.approx(20e-6, rel=0.1)
    assert np.std(found.verified.deviation) < 0.2 * np.std(found.before.deviation)
    assert calibrating.include_corrections(SCREW).startswith('include = "calibration.toml"\n')


@pytest.mark.slow  # a minute: from the first motion to the calibration
def test_commission_calibrates_and_includes_it(file: Path, tmp_path: Path) -> None:
    done = command("commission", "--config", file, "--calibrate", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "calibration: done" in done.stderr and "bidirectional accuracy" in done.stdout
    machine, settings = compositions.load(tmp_path / "out" / "machine.toml")
    assert machine.name == "axis" and settings.correction.half_width < 5e-6
    assert (tmp_path / "out" / "calibration.html").exists()
