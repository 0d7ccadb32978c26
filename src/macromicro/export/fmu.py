"""Co-simulation FMUs of exported units: FMI 2.0, sources and a binary, without Python."""

from __future__ import annotations

import hashlib
import math
import platform
import shutil
import subprocess
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

from macromicro import __version__
from macromicro.columns import Meaning, meaning
from macromicro.errors import InputError, MacromicroError
from macromicro.export import kinds
from macromicro.export._statements import Routine
from macromicro.export._text import filled, legal, notes_of, remark
from macromicro.export.files import Written, kind_of
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty
from macromicro.export.units import Entry
from macromicro.units import size

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")
INPUT, OUTPUT, PARAMETER, LOCAL = "input", "output", "parameter", "local"
NOTHING = Meaning()


class Variable(NamedTuple):
    name: str  # dotted
    causality: str  # as FMI has it
    path: str  # in C, behind the model
    start: float | None  # of inputs and parameters
    unit: str  # unit, or ""
    words: str  # meaning
    whole: bool = False  # whether it is an int or a bool, of which a copy is shown


class Call(NamedTuple):
    entry: str  # its name; the field of the model that holds what it returns
    text: str  # in C
    # where the new state is in what it returns; "" if that is the state; None for no new one
    moves: str | None
    kept: tuple[str, ...] = ()  # numbers that it returns for its next call


class Interface:
    """What an FMU has of a unit: variables, fields of the model, calls of a period."""

    def __init__(self, written: Written) -> None:
        self.written, self.unit, self.program = written, written.unit, written.program
        self.variables: list[Variable] = []
        self.fields: list[str] = []  # declarations in C
        self.starts: list[tuple[str, Any, Kind]] = []  # inputs: field, example, type
        self.calls: list[Call] = []
        self.state = self._state_kind()
        if self.state is not None:
            self.fields.append(self.program.declared(self.state, "state"))
        for key, value in self.unit.given.items():
            kind = kind_of(value)
            self.fields.append(self.program.declared(kind, f"given_{key}"))
            self._leaves(key, PARAMETER, f"given_{key}", value, kind)
        for entry, made in zip(self.unit.entries, written.entries, strict=True):
            if not entry.when:
                self._entry(entry, made)
        outputs = any(v.causality == OUTPUT for v in self.variables)
        if self.state is not None:
            self._leaves("state", LOCAL if outputs else OUTPUT, "state", None, self.state)
        if not any(v.causality == OUTPUT for v in self.variables):
            accepted = "a unit whose functions give numbers"
            raise InputError("WHAT", self.unit.name, accepted)

    def _state_kind(self) -> Any:
        if self.unit.state is not None:
            return kind_of(self.unit.state)
        first = self.unit.entries[0]
        return self.written.entries[0].result if first.name == "start" else None

    def _entry(self, entry: Entry, made: Routine) -> None:
        given = [
            self._argument(name, kind, value, made)
            for (name, kind), value in zip(made.parameters.items(), entry.arguments, strict=True)
            if not empty(kind)
        ]
        text = f"{made.name}({', '.join(given)})"
        if made.result == self.state and self.state is not None:
            self.calls.append(Call(entry.name, text, ""))
            return
        moves, field, several = None, f"out_{entry.name}", isinstance(made.result, Several)
        self.fields.append(self.program.declared(made.result, field, made if several else None))
        others = [e for e in self.unit.entries if e.name != "start" and not e.when]
        prefix = "" if len(others) == 1 or entry.name == "measure" else entry.name
        notes = made.source.results()
        if several:
            names = self.program.parts(made.result, made)
            notes = notes if len(notes) == len(names) else [NOTHING] * len(names)
            for name, kind, note in zip(names, made.result.types, notes, strict=True):
                if kind == self.state:
                    moves = name
                    continue
                shown = ".".join(filter(None, (prefix, name.rstrip("_"))))
                self._leaves(shown, OUTPUT, f"{field}.{name}", None, kind, note)
        else:
            shown = prefix or ("" if isinstance(made.result, Struct) else entry.name)
            shown = "true" if entry.name == "show" else shown
            self._leaves(shown, OUTPUT, field, None, made.result, notes[0])
        self.calls.append(Call(entry.name, text, moves, self.unit.memory))

    def _argument(self, name: str, kind: Kind, value: Any, made: Routine) -> str:
        for key, given in self.unit.given.items():
            if given is value:
                return f"&m->given_{key}"
        address = "&" if isinstance(kind, Struct | Several) else ""
        if self.state is not None and kind == self.state:
            return f"{address}m->state"
        if kind is REAL and name in ("dt", "t"):
            return "PERIOD" if name == "dt" else "m->time"
        if kind is WHOLE:
            return str(0 if isinstance(value, kinds.Scalar) else int(value))
        field = f"in_{legal(name)}"
        declared = self.program.declared(kind, field)
        if isinstance(kind, Rows):
            declared = self.program.array(kind, field)
        if declared not in self.fields:
            self.fields.append(declared)
            if isinstance(kind, Rows):
                noise = "standard normal draw of the sensors' noise"
                self.variables += [
                    Variable(f"{name}[{k}]", INPUT, f"{field}[0][{k}]", 0.0, "", noise)
                    for k in range(kind.shape[-1] or 0)
                ]
            elif name not in self.unit.memory:
                example = 0.0 if isinstance(value, kinds.Scalar) else value
                self.starts.append((field, example, kind))
                note = meaning(made.source.hints.get(name))
                self._leaves(name, INPUT, field, example, kind, note)
        return f"{address}m->{field}"

    def _leaves(
        self, name: str, causality: str, path: str, value: Any, kind: Kind, note: Meaning = NOTHING
    ) -> None:
        """Add the numbers of a value as variables."""
        if isinstance(kind, Struct | Several):
            fields = kind.fields if isinstance(kind, Struct) else self.program.parts(kind, None)
            notes = notes_of(kind.instance_class) if isinstance(kind, Struct) else {}
            for place, (field, part) in enumerate(zip(fields, kind.types, strict=True)):
                if not empty(part):
                    example = None if value is None else value[place]
                    full = f"{name}.{field}" if name else field
                    inner, about = f"{path}.{legal(field)}", notes.get(field, NOTHING)
                    self._leaves(full, causality, inner, example, part, about)
            return
        if kind not in (REAL, WHOLE, TRUTH):
            return
        given = causality in (INPUT, PARAMETER)
        clock = name.rpartition(".")[2] == "t" and note.unit == "s"
        if clock or (given and kind is not REAL) or (given and not math.isfinite(value)):
            return
        if name in {each.name for each in self.variables}:
            name = f"out.{name}"  # what goes in has that name
        start = float(value) if given else None
        unit, told = _known(note.unit), remark(note)
        self.variables.append(Variable(name, causality, path, start, unit, told, kind is not REAL))


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
    return filled(
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
        first.append(f"m->{field} = {program.literal(value, kind)};")
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
    return filled(
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


def _known(unit: str) -> str:
    """A unit that other tools know; "" for any other."""
    try:
        size(unit)
    except (MacromicroError, ValueError, KeyError):
        return ""
    return "" if unit in ("1", "-") else unit
