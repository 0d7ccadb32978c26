"""Readings that no program takes: a list, a CSV file, the keyboard."""

from __future__ import annotations

import io
import math
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
from tests.command import command

from macromicro.calibration import by_hand, procedure
from macromicro.calibration.request import ready
from macromicro.errors import InputError, ProblemError
from macromicro.machines import compositions

SCREW = Path(__file__).parents[2] / "examples" / "machines" / "screw.toml"


def run(*words: str | Path, cwd: Path) -> CompletedProcess[str]:
    return command("calibrate", *words, cwd=cwd)


def deviation(x: float, up: bool) -> float:
    """Of the person's screw, mm."""
    return 1e-3 * (4.0 * math.sin(2.0 * math.pi * x / 5.0) + (-6.0 if up else 6.0) + 0.1 * x)


def test_a_list_is_filled_in_and_read_back(tmp_path: Path) -> None:
    listed, filled = tmp_path / "list.csv", tmp_path / "filled.csv"
    words = ("--config", SCREW, "--positions", "16", "--runs", "2")
    assert run(*words, "--list", listed, cwd=tmp_path).returncode == 0
    again = run(*words, "--list", listed, cwd=tmp_path)
    assert again.returncode == 2 and "already exists" in again.stderr
    lines = []
    for line in listed.read_text("utf-8").splitlines():
        number, way, place, *_ = (*line.split(","), "", "")
        reading = ""
        if number.isdigit() and number != "0":
            reading = f"{float(place) + deviation(float(place), way == 'up'):.5f}"
        lines.append(line + reading)
    filled.write_text("\n".join(lines), encoding="utf-8")
    out = tmp_path / "out"
    done = run(*words, "--readings", filled, "--out", out, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "not verified" in (out / "calibration.html").read_text("utf-8")
    request = ready(SCREW, positions=16, runs=2)
    found = procedure.from_readings(request, by_hand.read_readings(filled, request))
    correction = found.settings.correction
    reversal = np.array(correction.down) - np.array(correction.up)
    assert reversal == pytest.approx(12e-6, rel=0.01)
    assert correction.period == pytest.approx(5e-3)
    assert correction.waves[0] == pytest.approx(4e-6, rel=0.02)
    slope = (correction.up[-1] - correction.up[0]) / (correction.high - correction.low)
    assert slope == pytest.approx(1e-4, rel=0.02)


def test_errors_with_directions_and_temperatures_are_read_too(tmp_path: Path) -> None:
    file = tmp_path / "errors.csv"
    rows = [
        f"{x},{way},{1e3 * deviation(x, way == 'up'):.3f},{20 + 0.1 * k}"
        for k, (x, way) in enumerate((x, way) for x in range(5, 80, 5) for way in ("up", "down"))
    ]
    head = "# a calibration house\nposition_mm,direction,error_um,temperature_degC"
    file.write_text("\n".join([head, *rows]), encoding="utf-8")
    found = by_hand.read_readings(file, ready(SCREW))
    assert found.deviation[0, 0] == pytest.approx(1e-3 * deviation(5.0, True), abs=1e-9)
    assert found.flank[:2, 0].tolist() == [1.0, 0.0]
    assert found.temperature[1] == pytest.approx(20.1)


def test_identify_reads_the_file_of_another_instrument(tmp_path: Path) -> None:
    """Columns in any order, with the instrument's own units and signs."""
    file, out = tmp_path / "house.csv", tmp_path / "out"
    rows = [
        f"{21 + 0.1 * (k % 3):.1f},{1e3 * deviation(25.4 * x, way == '+'):.3f},{way},{x}"
        for k, (x, way) in enumerate((0.12 * k, way) for k in range(1, 26) for way in "+-")
    ]
    head = "Temperature [C],Error (µm),direction,position_in"
    file.write_text("\n".join([head, *rows]), encoding="utf-8")
    words = ("calibration", file, "--machine", SCREW, "--out", out)
    done = command("identify", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "bidirectional accuracy" in done.stdout and "reversal: -12" in done.stdout
    first, last = done.stdout.split("from below, from above [um]\n")[1].split("\n")[:2]
    assert [round(float(cell)) for cell in first.split()[1:]] == [-6, 6]
    assert float(last.split()[1]) - float(first.split()[1]) == pytest.approx(8.0, abs=0.6)
    with_it = tmp_path / "machine.toml"
    text = f'include = "out/calibration.toml"\n{SCREW.read_text(encoding="utf-8")}'
    with_it.write_text(text, encoding="utf-8")
    correction = compositions.load(with_it)[1].correction
    assert correction.waves[0] == pytest.approx(4e-6, rel=0.02)
    assert correction.temperature == pytest.approx(21.1, abs=0.01)


def test_angles_are_read_in_seconds_of_arc(tmp_path: Path) -> None:
    machine, file = tmp_path / "table.toml", tmp_path / "polygon.csv"
    machine.write_text('machine = "rotary"\n[drive]\nratio = 1.0\n', encoding="utf-8")
    rows = [f"{k % 2 * 2 - 1},{10 * k},3.6" for k in range(8)]
    file.write_text("\n".join(["direction,position_deg,error_arcsec", *rows]), encoding="utf-8")
    found = by_hand.read_readings(file, ready(machine))
    assert found.deviation[:, 0] == pytest.approx(math.radians(1e-3))
    assert found.target[7, 0] == pytest.approx(math.radians(70.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("position_mm,direction\n1,up", "reference_mm or error_um"),
        ("position_mm,direction,error_um\n1,left,2", "up or down"),
        ("position_mm,direction,error_um\n1,up,two", "error_um"),
        ("position_mm,direction,error_um\n1,up,2", "1 readings"),
        ("position_kg,direction,error_um\n1,up,2", "position_kg"),
        ("position_mm,direction,error\n1,up,2", "error: 'no unit'; accepted: a unit"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "bad.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises((InputError, ProblemError), match=words):
        by_hand.read_readings(file, ready(SCREW))


def test_readings_typed_at_the_keyboard() -> None:
    request = ready(SCREW, positions=6, runs=2)
    shown = io.StringIO()
    answers = ["1.5", "nonsense", "2.5", "", "4", "5", "6", "7", "q"]
    found = by_hand.ask_readings(request, answers, shown)
    assert len(found.t) == 6 and found.reference[1, 0] == pytest.approx(2.5e-3)
    assert "nonsense is not a number" in shown.getvalue()
    assert "from below" in shown.getvalue() and "from above" in shown.getvalue()
    with pytest.raises(ProblemError, match="2 readings"):
        by_hand.ask_readings(request, ["1", "2", "q"], io.StringIO())
