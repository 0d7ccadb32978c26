"""FMUs of exported units: valid, and with our own numbers."""

from __future__ import annotations

import subprocess
import zipfile
from ctypes import CDLL, c_char_p
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from macromicro.control.stage_law import Sample, Target
from macromicro.export import building, catalogue, files, fmu
from macromicro.kernel import compiled
from macromicro.plant import axis, bench, carriage
from macromicro.settings import Settings

fmpy = pytest.importorskip("fmpy", reason="the extra `fmu` brings it")
QUICK = ("two_stage.plant", "axis.law", "two_stage.micro", "axis.guard")
PERIODS = 3000  # three seconds
# FMI 2.0, Sections 2.1.4 to 2.1.9 and 4.2.1 to 4.2.4.
FUNCTIONS = """
    GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment Reset
    EnterInitializationMode ExitInitializationMode Terminate GetReal GetInteger GetBoolean GetString
    SetReal SetInteger SetBoolean SetString GetFMUstate SetFMUstate FreeFMUstate
    SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate GetDirectionalDerivative
    SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus GetRealStatus
    GetIntegerStatus GetBooleanStatus GetStringStatus
"""


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


def test_the_macro_stage_gives_our_bits_for_seconds(volts: Any, tmp_path: Path) -> None:
    place = tmp_path / "macro.fmu"
    fmu.write(files.write_unit(catalogue.unit("two_stage.macro")), place)
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


def test_a_tunable_parameter_counts(volts: Any, tmp_path: Path) -> None:
    place = tmp_path / "axis.fmu"
    unit = catalogue.unit("axis.plant")
    fmu.write(files.write_unit(unit), place)
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


def sound(place: Path, name: str) -> None:
    """Written, valid, and it runs."""
    from fmpy.validation import validate_fmu

    fmu.write(files.write_unit(catalogue.unit(name)), place)
    assert validate_fmu(str(place)) == []
    found = fmpy.simulate_fmu(str(place), stop_time=0.02, output_interval=1e-3)
    assert len(found) == 21
    assert len(found.dtype.names) > 1


@pytest.mark.parametrize("name", QUICK)
def test_nothing_is_wrong_with_it(name: str, tmp_path: Path) -> None:
    sound(tmp_path / "unit.fmu", name)


@pytest.mark.slow
@pytest.mark.parametrize("name", [each for each in catalogue.every() if each not in QUICK])
def test_nothing_is_wrong_with_any_other(name: str, tmp_path: Path) -> None:
    sound(tmp_path / "unit.fmu", name)


@pytest.mark.parametrize("name", ["two_stage.inverse", "two_stage.terminal"])
def test_a_law_with_other_occasions_gives_our_bits(name: str, tmp_path: Path) -> None:
    """What it does after a rest, or in one, is no part of a period."""
    periods = 400
    unit, twin = catalogue.unit(name), catalogue.unit(name)
    assert [e.name for e in unit.entries if e.when]
    place = tmp_path / "law.fmu"
    fmu.write(files.write_unit(unit), place)
    signals = np.zeros(
        periods, dtype=[(n, "f8") for n in ("time", "target.position", "sample.position")]
    )
    signals["time"] = np.arange(periods) * unit.period
    signals["target.position"] = np.where(np.arange(periods) < 250, 2e-3, 1.5e-3)
    signals["sample.position"] = 1e-5 * np.round(0.4 * np.arange(periods))
    found = fmpy.simulate_fmu(
        str(place), stop_time=periods * unit.period, output_interval=unit.period,
        step_size=unit.period, input=signals, output=["effort"],
    )  # fmt: skip
    by_name = {each.name: each for each in twin.entries}
    gains, memory = twin.given["gains"], twin.state
    first = Sample(0.0, 0.0)
    if memory is None:
        memory = by_name["start"].function(gains, first)
    step, ours = by_name["step"].function, []
    for row in signals:
        target = Target(float(row["target.position"]), 0.0, 0.0)
        sample = Sample(float(row["time"]), float(row["sample.position"]))
        memory, effort = step(gains, memory, target, sample, unit.period)
        ours.append(effort)
    assert np.ptp(ours) > 0.1
    assert found["effort"][1 : periods + 1].tobytes() == np.array(ours).tobytes()


def test_simulink_finds_what_it_looks_for(tmp_path: Path) -> None:
    """FMI 2.0, Sections 2.1.2, 2.2, 2.3 and 4.2: names of folders, files and functions."""
    place = tmp_path / "macro.fmu"
    face = fmu.write(files.write_unit(catalogue.unit("two_stage.macro")), place)
    with zipfile.ZipFile(place) as packed:
        packed.extractall(tmp_path)
        names = packed.namelist()
    described = ElementTree.parse(tmp_path / "modelDescription.xml").getroot()
    simulation = described.find("CoSimulation")
    assert described.get("fmiVersion") == "2.0"
    assert simulation is not None
    identifier = simulation.get("modelIdentifier")
    assert identifier == face.written.name
    listed = [each.get("name") for each in simulation.iter("File")]
    assert listed
    assert {f"sources/{each}" for each in listed} <= set(names)
    library = CDLL(str(tmp_path / "binaries" / "linux64" / f"{identifier}.so"))
    missing = [each for each in FUNCTIONS.split() if not hasattr(library, f"fmi2{each}")]
    assert missing == []
    library.fmi2GetVersion.restype = library.fmi2GetTypesPlatform.restype = c_char_p
    assert (library.fmi2GetVersion(), library.fmi2GetTypesPlatform()) == (b"2.0", b"default")
    # An order of the outputs, by place in the list, which is counted from 1.
    variables = described.findall("ModelVariables/ScalarVariable")
    outputs = [k for k, v in enumerate(variables, 1) if v.get("causality") == "output"]
    unknown = described.findall("ModelStructure/Outputs/Unknown")
    assert [int(each.get("index", "0")) for each in unknown] == outputs
    kinds = {(v.get("causality"), v.get("variability")) for v in variables}
    assert kinds <= {("parameter", "tunable"), ("input", "discrete"), ("output", "discrete")}
    for each in variables:
        real = each.find("Real")
        assert real is not None
        assert (real.get("start") is None) == (each.get("causality") == "output")


def test_the_sources_alone_make_the_same_binary(tmp_path: Path) -> None:
    """What a simulator on another system compiles."""
    place = tmp_path / "macro.fmu"
    written = files.write_unit(catalogue.unit("two_stage.macro"))
    fmu.write(written, place)
    with zipfile.ZipFile(place) as packed:
        packed.extractall(tmp_path)
    again = tmp_path / "sources" / f"{written.name}.so"
    flags = (*building.FLAGS, "-fvisibility=hidden", "-fPIC")
    command = ["cc", *flags, *fmu.sources(written), "-o", again.name, "-lm"]
    subprocess.run(command, cwd=again.parent, check=True)
    packed_one = tmp_path / "binaries" / "linux64" / again.name
    assert again.read_bytes() == packed_one.read_bytes()


def test_a_state_is_kept_and_taken_back(tmp_path: Path) -> None:
    """With arrays of its own: those of the memory of the wire's relays."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    place = tmp_path / "wire.fmu"
    fmu.write(files.write_unit(catalogue.unit("wire.plant")), place)
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
