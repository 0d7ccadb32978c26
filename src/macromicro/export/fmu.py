"""Co-simulation FMUs of exported units: FMI 2.0 and 3.0, sources and a binary, without Python."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import zipfile
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.sax.saxutils import quoteattr

from macromicro import __version__
from macromicro.errors import InputError, MacromicroError
from macromicro.export._model import Model
from macromicro.export._variables import INPUT, OUTPUT, PARAMETER, Interface, Variable
from macromicro.export.files import Written

VERSIONS = (2, 3)
FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")
_PLACES = {2: "linux64", 3: "x86_64-linux"}


def _variable(v: Variable, reference: int, version: int) -> str:
    causality = v.causality
    about = f" description={quoteattr(v.words)}" if v.words else ""
    unit = f" unit={quoteattr(v.unit)}" if v.unit else ""
    start = f' start="{v.start!r}"' if v.start is not None else ""
    variability = "tunable" if causality == PARAMETER else "discrete"
    exact = "" if causality in (INPUT, PARAMETER) else ' initial="calculated"'
    head = f'name={quoteattr(v.name)} valueReference="{reference}"'
    rest = f'causality="{causality}" variability="{variability}"{exact}{about}'
    if version == 2:
        return f"    <ScalarVariable {head} {rest}><Real{unit}{start}/></ScalarVariable>"
    exact = "" if causality in (INPUT, PARAMETER) else exact
    return f"    <Float64 {head} {rest}{unit}{start}/>"


def description(face: Interface, token: str, version: int) -> str:
    """modelDescription.xml."""
    unit, name = face.unit, face.written.name
    units = sorted({v.unit for v in face.variables if v.unit})
    tool = f'generationTool="macromicro {__version__}"'
    about = f"modelName={quoteattr(unit.name)} description={quoteattr(unit.title)} {tool}"
    step = f'stepSize="{unit.period!r}"'
    outputs = [k for k, v in enumerate(face.variables, 1) if v.causality == OUTPUT]
    rows = [_variable(v, k, version) for k, v in enumerate(face.variables, 1)]
    shown = [f"    <Unit name={quoteattr(each)}/>" for each in units]
    defined = ["  <UnitDefinitions>", *shown, "  </UnitDefinitions>"] if shown else []
    head = '<?xml version="1.0" encoding="UTF-8"?>'
    if version == 2:
        able = 'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"'
        files = "".join(f"<File name={quoteattr(each)}/>" for each in sources(face.written, 2))
        lines = [
            head,
            f'<fmiModelDescription fmiVersion="2.0" guid="{token}" {about}'
            ' variableNamingConvention="structured">',
            f"  <CoSimulation modelIdentifier={quoteattr(name)} {able}>",
            f"    <SourceFiles>{files}</SourceFiles>",
            "  </CoSimulation>",
            *defined,
            f"  <DefaultExperiment {step}/>",
            "  <ModelVariables>",
            *rows,
            "  </ModelVariables>",
            "  <ModelStructure>",
            "    <Outputs>",
            *(f'      <Unknown index="{k}"/>' for k in outputs),
            "    </Outputs>",
            "    <InitialUnknowns>",
            *(f'      <Unknown index="{k}"/>' for k in outputs),
            "    </InitialUnknowns>",
            "  </ModelStructure>",
            "</fmiModelDescription>",
        ]
        return "\n".join([*lines, ""])
    able = 'canHandleVariableCommunicationStepSize="true" canGetAndSetFMUState="true"'
    time = (
        '    <Float64 name="time" valueReference="0" causality="independent" '
        'variability="continuous" description="time"/>'
    )
    lines = [
        head,
        f'<fmiModelDescription fmiVersion="3.0" instantiationToken="{token}" {about}'
        ' variableNamingConvention="structured">',
        f"  <CoSimulation modelIdentifier={quoteattr(name)} {able}/>",
        *defined,
        f"  <DefaultExperiment {step}/>",
        "  <ModelVariables>",
        time,
        *rows,
        "  </ModelVariables>",
        "  <ModelStructure>",
        *(f'    <Output valueReference="{k}"/>' for k in outputs),
        *(f'    <InitialUnknown valueReference="{k}"/>' for k in outputs),
        "  </ModelStructure>",
        "</fmiModelDescription>",
    ]
    return "\n".join([*lines, ""])


def sources(written: Written, version: int) -> tuple[str, ...]:
    """Names of the compiled files."""
    return (f"fmi{version}.c", "model.c", f"{written.name}.c")


def _build_description(written: Written) -> str:
    files = "".join(f'<SourceFile name="{each}"/>' for each in sources(written, 3))
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">'
        f'<BuildConfiguration modelIdentifier="{written.name}">'
        f'<SourceFileSet language="C99">{files}</SourceFileSet>'
        "</BuildConfiguration></fmiBuildDescription>\n"
    )


def write(written: Written, out: Path, version: int) -> Interface:
    """Write an FMU; `MacromicroError` where compiling fails."""
    if version not in VERSIONS:
        raise InputError("--fmi", version, "2 or 3")
    compiler = shutil.which("cc")
    machine = (platform.system(), platform.machine())
    if compiler is None or machine != ("Linux", "x86_64"):
        raise MacromicroError(
            "an FMU needs a C compiler, cc, on Linux x86_64 "
            "(Debian, Ubuntu: apt-get install gcc libc6-dev)"
        )
    face = Interface(written)
    digest = hashlib.sha256((written.header + written.code).encode()).hexdigest()[:32]
    token = f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:]}}}"
    own = resources.files("macromicro.export").joinpath("fmi")
    texts = {
        f"fmi{version}.c": own.joinpath(f"fmi{version}.c").read_text("utf-8"),
        "model.h": own.joinpath("model.h").read_text("utf-8"),
        "model.c": Model(face).text(token),
        f"{written.name}.h": written.header,
        f"{written.name}.c": written.code,
    }
    with TemporaryDirectory() as folder:
        for file, text in texts.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        library = f"{written.name}.so"
        command = [compiler, *FLAGS, *sources(written, version), "-o", library, "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise MacromicroError(
                f"cc failed to compile the FMU: {done.stderr.strip().splitlines()[0]}"
            )
        binary = (Path(folder) / library).read_bytes()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("modelDescription.xml", description(face, token, version))
        packed.writestr(f"binaries/{_PLACES[version]}/{library}", binary)
        for file, text in texts.items():
            packed.writestr(f"sources/{file}", text)
        if version == 3:
            packed.writestr("sources/buildDescription.xml", _build_description(written))
    return face
