"""The files of an exported unit: a header, the code, an example that runs it."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np

from macromicro import __version__
from macromicro.export import _helpers, _words, kinds
from macromicro.export._naming import legal, wrapped
from macromicro.export._program import Program
from macromicro.export._routines import Routine
from macromicro.export.kinds import REAL, Kind, Rows, Several, Struct, empty
from macromicro.export.units import Unit


class Table(NamedTuple):
    """An array of the initial state that the code changes."""

    path: str  # within the state
    kind: Rows
    name: str  # in the store
    source: str  # of its first values


class Written(NamedTuple):
    unit: Unit  # what it is
    name: str  # of its files and functions
    # header, code: NAME.h and NAME.c
    header: str
    code: str
    entries: tuple[Routine, ...]  # the functions that its user calls
    routines: tuple[Routine, ...]  # all functions, callees first
    program: Program  # all of it
    changed: tuple[Table, ...]  # arrays of the state that the code changes, which the caller keeps

    @property
    def store(self) -> bool:
        """Whether the state needs arrays of the caller's."""
        return bool(self.changed)


class Writer:
    def __init__(self, unit: Unit, single: bool) -> None:
        self.unit, self.program = unit, Program(single)
        self.name = re.sub(r"\W", "_", unit.name).strip("_")
        self.tables: list[str] = []
        self.changed: list[Table] = []

    def written(self) -> Written:
        program, unit = self.program, self.unit
        entries = []
        for entry in unit.entries:
            types = tuple(kind_of(each) for each in entry.arguments)
            hints = kinds.hints_of(entry.function)
            names = list(hints)[: len(types)]
            types = tuple(
                REAL if hints.get(n) is float and k is kinds.WHOLE else k
                for n, k in zip(names, types, strict=False)
            ) if len(names) == len(types) else types  # fmt: skip
            entries.append(program.routine(entry.function, types, name=f"{self.name}_{entry.name}"))
        given = [line for key, value in unit.given.items() for line in self._given(key, value)]
        begin = self._begin()
        used = self._used(entries)
        bodies: list[str] = []
        for made in program.order:
            if made in used:
                bodies += ["", *program.text(made, static=made not in entries)]
        code = [
            *self._top(),
            f'#include "{self.name}.h"',
            "",
            "#include <math.h>",
            "#include <stddef.h>",
            "",
            *_helpers.lines(program.helpers, program.single),
            *self.tables,
            *given,
            *bodies,
            *begin[1],
        ]
        header = self._header(entries, begin[0], "\n".join(bodies + given + begin[0] + begin[1]))
        return Written(
            unit, self.name, _joined(header), _joined(code), tuple(entries),
            tuple(made for made in program.order if made in used), program, tuple(self.changed),
        )  # fmt: skip

    def _used(self, entries: list[Routine]) -> list[Routine]:
        """Routines that the entries reach; those of branches that never run are dropped."""
        by_name = {made.name: made for made in self.program.order}
        todo, found = list(entries), list(entries)
        while todo:
            text = "\n".join(todo.pop().lines)
            for name in set(re.findall(r"\w+", text)) & set(by_name):
                if by_name[name] not in found:
                    found.append(by_name[name])
                    todo.append(by_name[name])
        return found

    def _top(self) -> list[str]:
        return _words.comment(
            f"{self.unit.title}: {self.unit.name} of macromicro {__version__}, exported.\n"
            "Made by a program: change the Python that it comes from. MIT licence."
        )

    def _header(self, entries: list[Routine], begin: list[str], code: str) -> list[str]:
        program = self.program
        guard = f"{self.name.upper()}_H"
        heads: list[str] = []
        for made in entries:
            heads += ["", *wrapped([f"{program.signature(made)};"])]
        constants = [
            f"#define {name} {text}"
            for name, text in program.constants.items()
            if re.search(rf"\b{name}\b", code)
        ]
        extern = [
            f"extern const {program.declared(kind_of(value), f'{self.name}_{key}')};"
            for key, value in self.unit.given.items()
        ]
        structs = program.struct_lines("\n".join([code, *heads, *extern]))
        return [
            *self._top(),
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#include <stdbool.h>",
            "#include <stdint.h>",
            "",
            *constants,
            "",
            *structs,
            "",
            *extern,
            *heads,
            *begin,
            "",
            "#endif",
        ]

    def _given(self, key: str, value: Any) -> list[str]:
        kind = kind_of(value)
        text = self._initialiser(value, kind, f"{self.name}_{key}", 0)
        declared = self.program.declared(kind, f"{self.name}_{key}")
        return ["", *f"const {declared} = {text};".splitlines()]

    def _initialiser(self, value: Any, kind: Kind, path: str, depth: int) -> str:
        if isinstance(kind, Rows):
            return self._table(value, kind, path)
        if not isinstance(kind, Struct | Several):
            return self.program.number(float(value) if kind is REAL else value)
        names = list(kind.fields) if isinstance(kind, Struct) else self.program.parts(kind, None)
        pad = "    " * (depth + 1)
        lines = []
        for name, each, part in zip(names, value, kind.types, strict=True):
            if empty(part):
                continue
            shown = self._initialiser(each, part, f"{path}_{name}", depth + 1)
            lines.append(f"{pad}.{legal(name)} = {shown},")
        return "{\n" + "\n".join(lines) + "\n" + "    " * depth + "}"

    def _table(self, value: Any, kind: Rows, name: str) -> str:
        if 0 in kind.shape:
            return "NULL"
        element = self.program.real if kind.element is REAL else self.program.whole
        sizes = "".join(f"[{n}]" for n in kind.shape)
        self.tables += ["", f"static const {element} {name}{sizes} = {{"]
        rows = value if len(kind.shape) > 1 else [value]
        for row in rows:
            numbers = [self.program.number(each) for each in np.ravel(row)]
            if len(kind.shape) > 1:
                numbers[0], numbers[-1] = f"{{{numbers[0]}", f"{numbers[-1]}}}"
            self.tables += _filled(numbers)
        self.tables.append("};")
        return name

    def _begin(self) -> tuple[list[str], list[str]]:
        """Head and body of the function that sets the initial state."""
        state, program = self.unit.state, self.program
        if state is None:
            return [], []
        kind = kind_of(state)
        plain = self._state(state, kind, "state")
        declared = program.declared(kind, "*state")
        store = f"{program.struct(kind)}Store"
        head = f"void {self.name}_begin({declared})"
        body, before = [], []
        if self.changed:
            head = f"void {self.name}_begin({declared}, {store} *store)"
            before = ["", *_words.comment("The arrays of a state; it points into them."),
                      "typedef struct {"]  # fmt: skip
            for each in self.changed:
                element = program.real if each.kind.element is REAL else program.whole
                sizes = "".join(f"[{n}]" for n in each.kind.shape)
                before.append(f"    {element} {each.name}{sizes};")
                body += self._filling(each, sizes)
            before.append(f"}} {store};")
        note = _words.comment("The state before the first period.")
        code = ["", *note, head, "{", f"    *state = ({program.struct(kind)}){plain};", *body, "}"]
        return [*before, "", f"{head};"], code

    def _filling(self, each: Table, sizes: str) -> list[str]:
        """Lines that fill an array of the store."""
        numbers = [int(n or 0) for n in each.kind.shape]
        flat = " * ".join(map(str, numbers))
        first = f"store->{each.name}" + "[0]" * (len(numbers) - 1)
        source = each.source + "[0]" * (len(numbers) - 1)
        real = self.program.real if each.kind.element is REAL else self.program.whole
        return [
            f"    state->{each.path} = store->{each.name};",
            "    {",
            f"        const {real} *from = (const {real} *){source};",
            f"        {real} *to = ({real} *){first};",
            f"        for (int k = 0; k < {flat}; k++) {{",
            "            to[k] = from[k];",
            "        }",
            "    }",
        ]

    def _state(self, value: Any, kind: Kind, path: str, depth: int = 1) -> str:
        if isinstance(kind, Rows):
            raise AssertionError("a state is a NamedTuple")
        if not isinstance(kind, Struct | Several):
            return self.program.number(float(value) if kind is REAL else value)
        fields = list(kind.fields) if isinstance(kind, Struct) else self.program.parts(kind, None)
        pad, lines = "    " * (depth + 1), []
        for name, each, part in zip(fields, value, kind.types, strict=True):
            if empty(part):
                continue
            here = f"{path}.{legal(name)}"
            if isinstance(part, Rows):
                label = here.partition(".")[2].replace(".", "_")
                written = isinstance(kind, Struct) and (
                    (kind.instance_class, name) in self.program.written
                )
                shown = self._table(each, part, f"{self.name}_start_{label}")
                if written:
                    self.changed.append(Table(here.partition(".")[2], part, label, shown))
                    shown = "NULL"
            else:
                shown = self._state(each, part, here, depth + 1)
            lines.append(f"{pad}.{legal(name)} = {shown},")
        return "{\n" + "\n".join(lines) + "\n" + "    " * depth + "}"


def kind_of(value: Any) -> Kind:
    if isinstance(value, kinds.Scalar | Struct | Several | Rows):
        return value
    return kinds.of_value(value)


def _filled(numbers: list[str]) -> list[str]:
    """Numbers in lines of about 90 characters."""
    lines, line = [], "   "
    for number in numbers:
        if len(line) + len(number) > 90:
            lines.append(line)
            line = "   "
        line += f" {number},"
    return [*lines, line]


def _joined(lines: list[str]) -> str:
    """Lines as text, without consecutive empty ones."""
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).rstrip() + "\n"


def written(unit: Unit, single: bool = False) -> Written:
    return Writer(unit, single).written()
