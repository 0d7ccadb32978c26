"""Co-simulation FMUs of exported units: FMI 2.0, sources and a binary, without Python."""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import zipfile
from importlib import resources
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from xml.sax.saxutils import quoteattr

from macromicro import __version__
from macromicro.errors import MacromicroError
from macromicro.export._variables import INPUT, OUTPUT, PARAMETER, Call, Interface, Variable
from macromicro.export.files import Written
from macromicro.export.kinds import Several, Struct

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")


def write(written: Written, out: Path) -> Interface:
    """Write an FMU; `MacromicroError` where compiling fails."""
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
    texts = {
        "fmi2.c": interface_code(face, token),
        f"{written.name}.h": written.header,
        f"{written.name}.c": written.code,
    }
    with TemporaryDirectory() as folder:
        for file, text in texts.items():
            (Path(folder) / file).write_text(text, encoding="utf-8")
        library = f"{written.name}.so"
        command = [compiler, *FLAGS, *sources(written), "-o", library, "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            raise MacromicroError(
                f"cc failed to compile the FMU: {done.stderr.strip().splitlines()[0]}"
            )
        binary = (Path(folder) / library).read_bytes()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("modelDescription.xml", description(face, token))
        packed.writestr(f"binaries/linux64/{library}", binary)
        for file, text in texts.items():
            packed.writestr(f"sources/{file}", text)
    return face


def sources(written: Written) -> tuple[str, ...]:
    """Names of the compiled files."""
    return ("fmi2.c", f"{written.name}.c")


def description(face: Interface, token: str) -> str:
    """modelDescription.xml."""
    units = sorted({v.unit for v in face.variables if v.unit})
    defined = ["  <UnitDefinitions>", *(f"    <Unit name={quoteattr(each)}/>" for each in units),
               "  </UnitDefinitions>"] if units else []  # fmt: skip
    rows = [_variable(v, k) for k, v in enumerate(face.variables, 1)]
    outputs = [k for k, v in enumerate(face.variables, 1) if v.causality == OUTPUT]
    return _filled(
        "modelDescription.xml",
        token=token,
        model=quoteattr(face.unit.name),
        title=quoteattr(face.unit.title),
        version=__version__,
        name=face.written.name,
        files="".join(f"<File name={quoteattr(each)}/>" for each in sources(face.written)),
        units="\n".join(defined),
        period=repr(face.unit.period),
        variables="\n".join(rows),
        outputs="\n".join(f'      <Unknown index="{k}"/>' for k in outputs),
    )


def _variable(v: Variable, reference: int) -> str:
    about = f" description={quoteattr(v.words)}" if v.words else ""
    unit = f" unit={quoteattr(v.unit)}" if v.unit else ""
    start = f' start="{v.start!r}"' if v.start is not None else ""
    variability = "tunable" if v.causality == PARAMETER else "discrete"
    exact = "" if v.causality in (INPUT, PARAMETER) else ' initial="calculated"'
    head = f'name={quoteattr(v.name)} valueReference="{reference}"'
    rest = f'causality="{v.causality}" variability="{variability}"{exact}{about}'
    return f"    <ScalarVariable {head} {rest}><Real{unit}{start}/></ScalarVariable>"


def interface_code(face: Interface, token: str) -> str:
    """fmi2.c: the standard's functions, which call the unit's functions once a control period."""
    written, program = face.written, face.written.program
    wholes = [v for v in face.variables if v.whole]
    fields = [f"{each};" for each in face.fields]
    if written.store:
        fields.append(f"{program.struct(face.state)}Store store;")
    if wholes:
        fields.append(f"double whole[{len(wholes)}]; /* copies of whole numbers */")
    first = [f"m->given_{key} = {written.name}_{key};" for key in face.unit.given]
    for field, value, kind in face.starts:
        made = f"({program.struct(kind)})" if isinstance(kind, Struct | Several) else ""
        first.append(f"m->{field} = {made}{program.plain(value, kind, lambda v, k: 'NULL')};")
    shown = [f"m->out_{c.entry} = {c.text};" for c in face.calls if c.moves is None and not c.kept]
    shown += [f"m->whole[{k}] = (double)m->{v.path};" for k, v in enumerate(wholes)]
    begun = []
    if face.unit.state is not None:
        store = ", &m->store" if written.store else ""
        begun.append(f"{written.name}_begin(&m->state{store});")
    elif face.calls[0].entry == "start" and face.calls[0].moves == "":
        begun.append(f"m->state = {face.calls[0].text};")
    cases = []
    for number, v in enumerate(face.variables, 1):
        path = f"whole[{wholes.index(v)}]" if v.whole else v.path
        cases += [f"case {number}:", f"    return &m->{path};"]
    return _filled(
        "fmi2.c",
        name=written.name,
        period=repr(face.unit.period),
        token=token,
        fields=_indented(fields, 4),
        reset=_indented(first, 4),
        show=_indented(shown, 4),
        start=_indented(begun, 4),
        step=_indented([line for call in face.calls for line in _effects(call)], 8),
        pointers=_indented([f"m->state.{t.path} = m->store.{t.name};" for t in written.changed], 4),
        variables=_indented(cases, 4),
    )


def _effects(call: Call) -> list[str]:
    """What a call changes in a period; one that only shows the state waits for the last one."""
    out = f"m->out_{call.entry}"
    if call.moves == "":
        return [f"m->state = {call.text};"] if call.entry != "start" else []
    if not call.moves and not call.kept:
        return []
    state = [f"m->state = {out}.{call.moves};"] if call.moves else []
    return [f"{out} = {call.text};", *state, *(f"m->in_{n} = {out}.{n};" for n in call.kept)]


def _indented(lines: list[str], spaces: int) -> str:
    return "\n".join(" " * spaces + line for line in lines)


def _filled(file: str, **places: str) -> str:
    """A template of the folder fmi, without empty lines where a place holds nothing."""
    text = resources.files("macromicro.export").joinpath("fmi", file).read_text("utf-8")
    empty = [name for name, value in places.items() if not value]
    for name in empty:
        text = text.replace(f"${name}\n", "")
    return Template(text).substitute(places)
