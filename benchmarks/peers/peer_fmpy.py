"""FMPy: `fmu.c`, compiled and zipped as an FMI 2.0 co-simulation unit, one step a period.

The unit is unpacked and its description read once, as the manual advises for many runs.
"""

from __future__ import annotations

import platform
import tempfile
import zipfile
from pathlib import Path
from typing import Any

from compiling import NATIVE, library
from job import Job
from peer import Run, main

GUID = "{6f1d9a52-4a6e-4a39-9c53-0d2f3c1b7a10}"
NAME = "loop"
OUTPUTS = ("counts", "volts")
_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{guid}">
<CoSimulation modelIdentifier="{name}"/>
<DefaultExperiment startTime="0" stopTime="{stop}" stepSize="{step}"/>
<ModelVariables>
"""
_PARAMETER = """<ScalarVariable name="{}" valueReference="{}" causality="parameter"
 variability="tunable" initial="exact"><Real start="{!r}"/></ScalarVariable>
"""
_OUTPUT = """<ScalarVariable name="{}" valueReference="{}" causality="output"
 variability="discrete" initial="calculated"><Real/></ScalarVariable>
"""
_TAIL = """</ModelVariables>
<ModelStructure><Outputs>{0}</Outputs><InitialUnknowns>{0}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def parameters(job: Job) -> dict[str, float]:
    """The unit's parameters in the order of `fmu.c`."""
    return {name: value for name, value in job._asdict().items() if name != "samples"}


def description(job: Job) -> str:
    """modelDescription.xml."""
    names = parameters(job)
    parts = [_HEAD.format(name=NAME, guid=GUID, stop=(job.samples - 1) * job.dt, step=job.dt)]
    parts += [_PARAMETER.format(n, k, v) for k, (n, v) in enumerate(names.items())]
    parts += [_OUTPUT.format(n, len(names) + k) for k, n in enumerate(OUTPUTS)]
    unknowns = "".join(f'<Unknown index="{len(names) + k + 1}"/>' for k in range(len(OUTPUTS)))
    return "".join(parts) + _TAIL.format(unknowns)


def unit(job: Job, folder: Path) -> Path:
    """The zipped unit, in `folder`; Linux and macOS."""
    system, suffix = {"Linux": ("linux64", ".so"), "Darwin": ("darwin64", ".dylib")}[
        platform.system()
    ]
    built = library("fmu.c", folder, NATIVE, NAME)
    place = folder / f"{NAME}.fmu"
    with zipfile.ZipFile(place, "w") as packed:
        packed.writestr("modelDescription.xml", description(job))
        packed.write(built, f"binaries/{system}/{NAME}{suffix}")
    return place


def prepare(job: Job) -> Run:
    """Build and unpack the unit; a run is one `simulate_fmu`."""
    import fmpy

    folder = Path(tempfile.mkdtemp())
    place = unit(job, folder)
    unpacked = fmpy.extract(str(place), str(folder / "unpacked"))
    described = fmpy.read_model_description(unpacked)
    start = parameters(job)

    def run() -> tuple[Any, Any]:
        found = fmpy.simulate_fmu(
            unpacked,
            validate=False,
            start_time=0.0,
            stop_time=(job.samples - 1) * job.dt,
            output_interval=job.dt,
            start_values=start,
            output=OUTPUTS,
            model_description=described,
        )
        return found["counts"], found["volts"]

    return run


if __name__ == "__main__":
    main(prepare)
