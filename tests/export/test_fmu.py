"""FMUs of exported units: valid, and with our own numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.export import catalogue, files, fmu
from macromicro.kernel import compiled
from macromicro.plant import axis, bench, carriage
from macromicro.settings import Settings

fmpy = pytest.importorskip("fmpy", reason="the extra `fmu` brings it")
VERSIONS = (2, 3)
PERIODS = 10_000  # ten seconds


def simulated(place: Path, signals: Any, **options: Any) -> Any:
    return fmpy.simulate_fmu(
        str(place), stop_time=PERIODS * 1e-3, output_interval=1e-3, step_size=1e-3,
        input=signals, **options,
    )  # fmt: skip


@pytest.fixture(scope="module")
def volts() -> np.ndarray[Any, np.dtype[np.float64]]:
    """Motor volts that change sign and rest, held for a tenth of a second each."""
    chosen = np.random.default_rng(7).uniform(-24.0, 24.0, PERIODS // 100)
    chosen[::7] = 0.0
    return np.repeat(chosen, 100)


def inputs(name: str, values: Any) -> Any:
    """What FMPy takes: a step at each period, before which the last value is held."""
    found = np.zeros(len(values), dtype=[("time", "f8"), (name, "f8")])
    found["time"], found[name] = np.arange(len(values)) * 1e-3, values
    return found


@pytest.mark.parametrize("version", VERSIONS)
def test_the_macro_stage_gives_our_bits_for_ten_seconds(
    version: int, volts: Any, tmp_path: Path
) -> None:
    place = tmp_path / "macro.fmu"
    fmu.write(files.written(catalogue.unit("two_stage.macro")), place, version)
    found = simulated(place, inputs("volts", volts), output=["state.x", "state.v", "state.accel"])
    plant = bench.prepare(Settings().bench, Settings().sensors)
    state, ours = carriage.at_rest(0.0), []
    step = compiled(carriage.advance)
    for each in volts:
        ours.append((state.x, state.v, state.accel))
        state = step(plant.macro, state, float(each), 1e-3, plant.macro_steps)
    expected = np.array(ours)
    shown = np.array([found[n] for n in ("state.x", "state.v", "state.accel")]).T[:PERIODS]
    assert np.ptp(expected[:, 0]) > 0.01
    assert shown.tobytes() == expected.tobytes()


@pytest.mark.parametrize("version", VERSIONS)
def test_a_tunable_parameter_counts(version: int, volts: Any, tmp_path: Path) -> None:
    place = tmp_path / "axis.fmu"
    unit = catalogue.unit("axis.plant")
    fmu.write(files.written(unit), place, version)
    params = unit.given["params"]
    heavy = params._replace(load=params.load._replace(mass=2.0))
    signals = inputs("effort", 0.08 * volts)
    found = simulated(
        place, signals, start_values={"params.load.mass": 2.0}, output=["true.position"]
    )
    periods = round(PERIODS * 1e-3 / unit.period)
    state, step, ours = axis.at_rest(heavy), compiled(axis.advance), []
    noise = np.zeros((1, axis.NOISES))
    per = round(1e-3 / unit.period)
    for k in range(periods):
        if k % per == 0:
            ours.append(axis.truth(heavy, state).position)
        state = step(heavy, state, float(0.08 * volts[k // per]), noise, 0, unit.period)
    assert found["true.position"][: len(ours)].tobytes() == np.array(ours).tobytes()
    assert np.ptp(ours) > 0.01


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["two_stage.plant", "axis.law", "two_stage.micro", "axis.guard"])
def test_nothing_is_wrong_with_it(name: str, version: int, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    place = tmp_path / "unit.fmu"
    fmu.write(files.written(catalogue.unit(name)), place, version)
    assert validate_fmu(str(place)) == []


def test_a_state_is_kept_and_taken_back(tmp_path: Path) -> None:
    """With arrays of its own: those of the memory of the wire's relays."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    place = tmp_path / "wire.fmu"
    fmu.write(files.written(catalogue.unit("wire.plant")), place, 2)
    told = read_model_description(str(place))
    one = FMU2Slave(
        guid=told.guid, unzipDirectory=extract(str(place), str(tmp_path / "wire")),
        modelIdentifier=told.coSimulation.modelIdentifier,
    )  # fmt: skip
    names = {v.name: v.valueReference for v in told.modelVariables}
    one.instantiate()
    one.setupExperiment()
    one.enterInitializationMode()
    one.exitInitializationMode()

    def heated(ctrl: float) -> list[float]:
        shown = []
        one.setReal([names["effort"]], [ctrl])
        for k in range(200):
            one.doStep(k * 1e-3, 1e-3)
            shown += one.getReal([names["true.position"]])
        return shown

    heated(1.7)
    kept = one.getFMUState()
    first = heated(1.2)
    one.setFMUState(kept)
    assert heated(1.2) == first
    one.freeFMUState(kept)
    one.terminate()
    one.freeInstance()


def test_another_version_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="2 or 3"):
        fmu.write(files.written(catalogue.unit("notch")), tmp_path / "x.fmu", 1)
