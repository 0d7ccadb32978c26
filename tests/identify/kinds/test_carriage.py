"""`identify carriage` from files: what it refuses, and a model that a run takes."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from macromicro import api
from macromicro.errors import InputError
from macromicro.identify import kinds
from macromicro.identify.kinds import carriage
from macromicro.identify.picking import Picking, load, runs
from macromicro.plant import bench
from macromicro.settings import Settings
from macromicro.thesis import strokes

VOLTS = np.concatenate([strokes.efforts(5.0)[:9000]])


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Strokes of the shipped bench."""
    plant = bench.prepare(Settings().bench, Settings().sensors)
    path = tmp_path_factory.mktemp("strokes") / "carriage.h5"
    strokes.stroke(plant, VOLTS, 900.0, 1).save(path)
    return path


def written(path: Path, columns: str, rows: str) -> Path:
    path.write_text(f"{columns}\n" + "\n".join(rows.split("|")) + "\n")
    return path


def test_without_a_laser_the_travel_per_count_is_asked_for(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "t,u,x", "|".join(f"{k / 1e3},5,{k}" for k in range(300)))
    with pytest.raises(InputError, match=r"^pitch: the travel per count is unknown"):
        kinds.from_files("carriage", path)
    for pitch, said in (("71", "^pitch: "), ("-1 um", "above zero"), ("3 kg", "^pitch: ")):
        with pytest.raises(InputError, match=said):
            kinds.from_files("carriage", path, pitch=pitch)


def test_a_laser_that_falls_with_the_encoder_is_refused(tmp_path: Path) -> None:
    rows = "|".join(f"{k / 1e3},5,{k},{-70 * k}" for k in range(300))
    path = written(tmp_path / "a.csv", "t,u,x,y [um]", rows)
    with pytest.raises(InputError, match="laser must rise with x"):
        kinds.from_files("carriage", path)


@pytest.mark.slow
def test_strokes_of_the_bench_give_a_model_under_which_it_runs(file: Path, tmp_path: Path) -> None:
    """The drive within 5 % of the bench's own figures, the swing within 1 %; moves are exact."""
    plant = bench.prepare(Settings().bench, Settings().sensors)
    other = tmp_path / "other.h5"
    strokes.stroke(plant, -VOLTS, 1900.0, 2).save(other)
    found = kinds.from_files("carriage", file, tests=(str(other),))
    test = next(line for line in found.lines if line.name == "test")
    assert test.value > 90.0
    assert "not fitted" in test.note
    assert set(found.plot()) == {"free_run", "residuals", "friction"}
    b = Settings().bench
    push = b.motor.constant / (b.motor.resistance * b.motor.pulley) * 4.0 / b.carriage.mass
    values = {line.name: line.value for line in found.lines}
    assert values["push"] == pytest.approx(push, rel=0.05)
    assert values["frequency"] == pytest.approx(b.belt.frequency, rel=0.01)
    assert values["share"] == pytest.approx(b.belt.participation, rel=0.1)
    assert values["pitch"] == pytest.approx(Settings().sensors.encoder.pitch, rel=1e-3)
    found.save(tmp_path / "model")
    settings = api.load_settings(tmp_path / "model" / "model.toml")
    assert settings.controller.macro_law == "terminal"
    assert settings.controller.own.push == pytest.approx(values["push"], rel=1e-4)
    moves = tmp_path / "moves.toml"
    moves.write_text('[[moves]]\nmacro = ["150 mm", "20 mm"]\nhold = "0.5 s"\n')
    for move in api.moves(api.run(moves, settings=settings)):
        assert move.final_error_counts == 0.0


def test_a_test_without_a_stroke_or_of_another_rate_is_refused(file: Path, tmp_path: Path) -> None:
    rest = "|".join(f"{k / 1e3},0,5" for k in range(300))
    still = written(tmp_path / "still.csv", "t,u,x", rest)
    slow = "|".join(f"{k / 100},{5 * (40 < k < 90)},{max(k - 40, 0)}" for k in range(300))
    other = written(tmp_path / "slow.csv", "t,u,x", slow)
    fit = SimpleNamespace(dt=1e-3)
    for path, said in ((still, "no stroke"), (other, "sample time is 0.01 s")):
        part = runs(load(Picking((path,), {}), carriage.ROLES)[0])[0]
        with pytest.raises(InputError, match=rf"--test, .*{said}"):
            carriage._predict(fit, part, str(path))
