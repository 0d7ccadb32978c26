"""Facts about a machine's calibrations, for its clients."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.serve.settings import load
from macromicro.serve.telling import calibrations

EXAMPLES = Path(__file__).parents[2] / "examples" / "machines"
CORRECTION = """
[{stage}correction]
made = "2026-11-01"
temperature = "21 degC"
cold = "19 degC"
hot = "23 degC"
"""


@pytest.mark.parametrize(
    ("example", "stages"),
    [("screw", ()), ("screw", ("",)), ("xy-plotter", ("y",)), ("xy-plotter", ("x", "y"))],
)
def test_each_calibrated_stage_has_its_date_and_temperatures(
    example: str, stages: tuple[str, ...], tmp_path: Path
) -> None:
    text = (EXAMPLES / f"{example}.toml").read_text(encoding="utf-8")
    for stage in stages:
        text += CORRECTION.format(stage=stage and f"{stage}.")
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    found = calibrations(load(tmp_path / "own.toml"))
    told = {"made": "2026-11-01", "temperature": 21.0, "cold": 19.0, "hot": 23.0}
    assert found == [{"stage": stage, **told} for stage in stages]


def test_the_two_stage_machine_has_none() -> None:
    assert calibrations(load(None)) == []
