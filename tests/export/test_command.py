"""`macromicro export`: files, and what is refused."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from macromicro.control import calibration
from macromicro.export import catalogue, files
from tests.command import command as macromicro
from tests.export.bound import CC, FLAGS

ROOT = Path(__file__).parents[2]
LAW = '''
from typing import Annotated, NamedTuple

from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import kernel
from macromicro.schema.par import Par


class Gains(NamedTuple):
    """Gains."""

    stiffness: Annotated[float, Par("V/m", "effort per error")] = 2000.0


class Memory(NamedTuple):
    """What it remembers."""

    error: float


@kernel
def start(p: Gains, sample: Sample) -> Memory:
    """No error yet."""
    return Memory(0.0)


@kernel
def step(
    p: Gains, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    """Proportional."""
    error = target.position - sample.position
    return Memory(error), p.stiffness * error


def loud(
    p: Gains, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[Memory, float]:
    print(p)
    return s, 0.0


LAW = StageLaw("mine", Gains, Memory, start, step)
PLAIN = StageLaw("plain", Gains._replace if False else type("G", (Gains,), {}), Memory, start, loud)
'''


def command(*words: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return macromicro("export", *words, cwd=cwd)


@pytest.mark.parametrize("name", catalogue.every())
def test_every_unit_compiles_in_float(name: str, tmp_path: Path) -> None:
    """Without a warning; the tests of bits compile every unit in double."""
    written = files.write_unit(catalogue.unit(name), single=True)
    (tmp_path / f"{written.name}.h").write_text(written.header)
    (tmp_path / f"{written.name}.c").write_text(written.code)
    assert CC is not None
    command = [CC, *FLAGS, "-Wdouble-promotion", "-c", f"{written.name}.c"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_three_files_and_what_is_said(tmp_path: Path) -> None:
    done = command("c", "axis.law", "--out", "law", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "results: law"
    folder = tmp_path / "law"
    assert {place.name for place in folder.iterdir()} == {"axis_law.h", "axis_law.c", "README.md"}
    header = (folder / "axis_law.h").read_text()
    assert "double velocity; /* effort per velocity error, V*s/m */" in header
    readme = (folder / "README.md").read_text()
    assert "$" not in readme
    (compiled,) = [line for line in readme.splitlines() if line.startswith("    cc ")]
    subprocess.run(compiled.split(), cwd=folder, check=True)
    assert (folder / "axis_law.o").is_file()
    assert command("c", "axis.law", "--out", "law", cwd=tmp_path).returncode == 2
    assert command("c", "axis.law", "--out", "law", "--overwrite", cwd=tmp_path).returncode == 0


def test_the_values_of_a_settings_file_are_written(tmp_path: Path) -> None:
    config = ROOT / "examples" / "machines" / "servo.toml"
    done = command("c", "rotary.plant", "--config", config, "--out", "x", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert ".resistance = 2.6," in (tmp_path / "x" / "rotary_plant.c").read_text()
    other = command("c", "axis.law", "--config", config, cwd=tmp_path)
    assert other.returncode == 2
    assert "rotary.law" in other.stderr


def test_a_law_of_ones_own(tmp_path: Path) -> None:
    (tmp_path / "mylab.py").write_text(LAW)
    done = command("c", "mylab:LAW", "--out", "law", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    code = (tmp_path / "law" / "LAW.c").read_text()
    assert "p->stiffness * error" in code
    plain = command("c", "mylab:PLAIN", cwd=tmp_path)
    assert plain.returncode == 2
    assert "plain Python" in plain.stderr
    alone = command("c", "mylab:step", "--out", "one", cwd=tmp_path)
    assert alone.returncode == 0, alone.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("c axis.lw", "'axis.law'?"),
        ("c macromicro.loop:rollout", "array whose annotation gives no size"),
        ("c no.such.module:thing", "no module no"),
        ("c axis.law --config missing.toml", "missing.toml"),
        ("fmus axis.law", "one of list, c, fmu"),
    ],
)
def test_bad_input(words: str, said: str, tmp_path: Path) -> None:
    done = command(*words.split(), cwd=tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert not list(tmp_path.iterdir())


def test_the_list_names_every_unit(tmp_path: Path) -> None:
    done = command("list", cwd=tmp_path)
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(catalogue.every())


def test_an_fmu_is_written_once(tmp_path: Path) -> None:
    done = command("fmu", "notch", "--out", "notch.fmu", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "1 inputs, 1 outputs, 3 tunable parameters, period 0.001 s" in done.stdout
    assert command("fmu", "notch", "--out", "notch.fmu", cwd=tmp_path).returncode == 2


def test_an_exported_supervisor_has_encoder_and_hall_table_of_the_settings(tmp_path: Path) -> None:
    config = tmp_path / "mine.toml"
    config.write_text(
        'controller.macro_law = "terminal"\nsensors.encoder.pitch = "50 um"\n'
        'sensors.hall.gain = "2.5 V"\n'
    )
    given = catalogue.unit("two_stage.supervisor", config).given["params"]
    assert given.macro.scale == 50e-6  # m per count, of a law in m
    position = calibration.position(given.calibration, 2.0)
    assert position != pytest.approx(calibration.position(calibration.default_calibration(), 2.0))
