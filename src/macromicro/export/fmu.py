"""Co-simulation FMUs of exported units: FMI 2.0, sources and a binary, without Python."""

from __future__ import annotations

import hashlib
import math
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

from macromicro import __version__
from macromicro.columns import Meaning, meaning
from macromicro.errors import InputError, MacromicroError
from macromicro.export import building, kinds
from macromicro.export._statements import Routine
from macromicro.export._text import fill, legal, notes_of, remark
from macromicro.export.files import Written, kind_of
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty
from macromicro.export.units import Entry
from macromicro.units import size

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


class Interface:
    """What an FMU has of a unit: its variables, and lines of C for the places of fmi2.c."""

    def __init__(self, written: Written) -> None:
        self.written, self.unit, self.program = written, written.unit, written.program
        self.variables: list[Variable] = []
        self.fields: list[str] = []  # the model's declarations
        self.reset: list[str] = []  # parameters and inputs as at the start
        self.start: list[str] = []  # the state that follows from them
        self.step: list[str] = []  # a control period
        self.show: list[str] = []  # outputs of the present state
        self.state = self._state_kind()
        if self.state is not None:
            self.fields.append(f"{self.program.declared(self.state, 'state')};")
        if self.unit.state is not None:
            store = ", &m->store" if written.store else ""
            self.start.append(f"{written.name}_begin(&m->state{store});")
        for key, value in self.unit.given.items():
            kind = kind_of(value)
            self.fields.append(f"{self.program.declared(kind, f'given_{key}')};")
            self.reset.append(f"m->given_{key} = {written.name}_{key};")
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
            (self.start if entry.name == "start" else self.step).append(f"m->state = {text};")
            return
        field = f"out_{entry.name}"
        self.fields.append(f"{self.program.declared(made.result, field, made)};")
        kept = [f"m->in_{name} = m->{field}.{name};" for name in self.unit.memory]
        others = [e for e in self.unit.entries if e.name != "start" and not e.when]
        prefix = "" if len(others) == 1 or entry.name == "measure" else entry.name
        notes = made.source.results()
        if isinstance(made.result, Several):
            names = self.program.parts(made.result, made)
            notes = notes if len(notes) == len(names) else [NOTHING] * len(names)
            for name, kind, note in zip(names, made.result.types, notes, strict=True):
                if kind == self.state:
                    kept.insert(0, f"m->state = m->{field}.{name};")
                    continue
                shown = ".".join(filter(None, (prefix, name.rstrip("_"))))
                self._leaves(shown, OUTPUT, f"{field}.{name}", None, kind, note)
        else:
            shown = prefix or ("" if isinstance(made.result, Struct) else entry.name)
            shown = "true" if entry.name == "show" else shown
            self._leaves(shown, OUTPUT, field, None, made.result, notes[0])
        # A call without a memory shows the state; the others are made once a period.
        (self.step if kept else self.show).extend([f"m->{field} = {text};", *kept])

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
        declared = f"{self.program.declared(kind, field)};"
        if isinstance(kind, Rows):
            declared = f"{self.program.array(kind, field)};"
        if declared not in self.fields:
            self.fields.append(declared)
            if isinstance(kind, Rows):
                note = meaning(made.source.hints.get(name))
                told = remark(note) or "standard normal draw of the sensors' noise"
                row = "[0]" if len(kind.shape) > 1 else ""
                self.variables += [
                    Variable(f"{name}[{k}]", INPUT, f"{field}{row}[{k}]", 0.0, note.unit, told)
                    for k in range(kind.shape[-1] or 0)
                ]
            elif name not in self.unit.memory:
                example = 0.0 if isinstance(value, kinds.Scalar) else value
                self.reset.append(f"m->{field} = {self.program.literal(example, kind)};")
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
        unit, told = _known_unit(note.unit), remark(note)
        self.variables.append(Variable(name, causality, path, start, unit, told, kind is not REAL))


def write(written: Written, out: Path, systems: Sequence[str] = ()) -> Interface:
    """Write an FMU for these systems, or this one; `MacromicroError` where compiling fails."""
    face = Interface(written)
    digest = hashlib.sha256((written.header + written.code).encode()).hexdigest()[:32]
    token = f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:]}}}"
    texts = {
        "fmi2.c": interface_code(face, token),
        f"{written.name}.h": written.header,
        f"{written.name}.c": written.code,
    }
    binaries = building.libraries(written.name, texts, systems, hidden=True)
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("modelDescription.xml", description(face, token))
        for path, binary in binaries.items():
            packed.writestr(f"binaries/{path}", binary)
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
    return fill(
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
    written, wholes = face.written, [v for v in face.variables if v.whole]
    fields = list(face.fields)
    if written.store:
        fields.append(f"{written.program.struct(face.state)}Store store;")
    if wholes:
        fields.append(f"double whole[{len(wholes)}]; /* copies of whole numbers */")
    copies = [f"m->whole[{k}] = (double)m->{v.path};" for k, v in enumerate(wholes)]
    cases = []
    for number, v in enumerate(face.variables, 1):
        path = f"whole[{wholes.index(v)}]" if v.whole else v.path
        cases += [f"case {number}:", f"    return &m->{path};"]
    return fill(
        "fmi2.c",
        name=written.name,
        period=repr(face.unit.period),
        token=token,
        fields=_indent(fields, 4),
        reset=_indent(face.reset, 4),
        show=_indent([*face.show, *copies], 4),
        start=_indent(face.start, 4),
        step=_indent(face.step, 8),
        pointers=_indent([f"m->state.{t.path} = m->store.{t.name};" for t in written.changed], 4),
        variables=_indent(cases, 4),
    )


def _indent(lines: list[str], spaces: int) -> str:
    return "\n".join(" " * spaces + line for line in lines)


def _known_unit(unit: str) -> str:
    """A unit that other tools know; "" for any other."""
    try:
        size(unit)
    except (MacromicroError, ValueError, KeyError):
        return ""
    return "" if unit in ("1", "-") else unit
