"""The files of an exported unit: a header, the code, a page about them."""

from __future__ import annotations

import re
import textwrap
from typing import Any, NamedTuple

import numpy as np

from macromicro import __version__
from macromicro.export import kinds
from macromicro.export._program import Program
from macromicro.export._statements import Routine
from macromicro.export._text import fill, helpers, identifiers, legal, plain, wrap
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
    header: str  # NAME.h
    code: str  # NAME.c
    entries: tuple[Routine, ...]  # the functions that its user calls
    routines: tuple[Routine, ...]  # all functions, callees first
    program: Program  # all of it
    changed: tuple[Table, ...]  # arrays of the state that the code changes, which the caller keeps

    @property
    def store(self) -> bool:
        """Whether the state needs arrays of the caller's."""
        return bool(self.changed)

    def readme(self) -> str:
        return fill("readme.md", name=self.name, real=self.program.real, **_about(self.unit))


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
            types = [kind_of(each) for each in entry.arguments]
            entries.append(program.routine(entry.function, types, name=f"{self.name}_{entry.name}"))
        given = [line for key, value in unit.given.items() for line in self._given(key, value)]
        declared, begin = self._begin()
        used = self._used(entries)
        bodies: list[str] = []
        for made in used:
            bodies += ["", *program.text(made, static=made not in entries)]
        code = fill(
            "code.c",
            name=self.name,
            helpers="\n".join(helpers(program.helpers, program.single)),
            tables="\n".join(self.tables),
            parameters="\n".join(given),
            functions="\n".join(bodies),
            begin="\n".join(begin),
            **_about(unit),
        )
        header = self._header(entries, declared, [*bodies, *given, *begin])
        return Written(unit, self.name, header, code, tuple(entries), tuple(used), program,
                       tuple(self.changed))  # fmt: skip

    def _used(self, entries: list[Routine]) -> list[Routine]:
        """Routines that the entries reach; those of branches that never run are dropped."""
        found = set(entries)
        for made in reversed(self.program.order):  # callers stand behind their callees
            if made in found:
                called = identifiers(made.lines)
                found |= {each for each in self.program.order if each.name in called}
        return [made for made in self.program.order if made in found]

    def _header(self, entries: list[Routine], begin: list[str], code: list[str]) -> str:
        program = self.program
        heads: list[str] = []
        for entry, made in zip(self.unit.entries, entries, strict=True):
            when = [f"// {entry.when}"] if entry.when else []
            heads += ["", *when, *made.source.head, *wrap([f"{program.signature(made)};"])]
        extern = [
            f"extern const {program.declared(kind_of(value), f'{self.name}_{key}')};"
            for key, value in self.unit.given.items()
        ]
        used = identifiers([*code, *heads, *extern, *begin])
        constants = [
            f"#define {name} {text}" for name, text in program.constants.items() if name in used
        ]
        return fill(
            "header.h",
            guard=self.name.upper(),
            constants="\n".join(constants),
            structs="\n".join(program.struct_lines(used)),
            parameters="\n".join(extern),
            begin="\n".join(begin),
            functions="\n".join(heads),
            **_about(self.unit),
        )

    def _given(self, key: str, value: Any) -> list[str]:
        kind = kind_of(value)
        text = self._initialiser(value, kind, (key,), 0)
        declared = self.program.declared(kind, f"{self.name}_{key}")
        return ["", *f"const {declared} = {text};".splitlines()]

    def _begin(self) -> tuple[list[str], list[str]]:
        """Declaration and definition of the function that sets the initial state."""
        state, program = self.unit.state, self.program
        if state is None:
            return [], []
        kind = kind_of(state)
        text = self._initialiser(state, kind, ("start",), 1)
        store, filled, declared = f"{program.struct(kind)}Store", [], []
        for each in self.changed:
            declared.append(f"    {program.array(each.kind, each.name)};")
            filled += [
                f"    memcpy(store->{each.name}, {each.source}, sizeof store->{each.name});",
                f"    state->{each.path} = store->{each.name};",
            ]
        if declared:
            about = "/* The arrays of a state, which points into them. */"
            declared = ["", about, "typedef struct {", *declared, f"}} {store};"]
        given = f"{program.declared(kind, '*state')}{f', {store} *store' if declared else ''}"
        head = f"void {self.name}_begin({given})"
        state_line = f"    *state = ({program.struct(kind)}){text};"
        code = ["", head, "{", state_line, *wrap(filled), "}"]
        return [*declared, "", "/* The state before the first period. */", f"{head};"], code

    def _initialiser(
        self, value: Any, kind: Kind, path: tuple[str, ...], depth: int, changed: bool = False
    ) -> str:
        """A value over several lines; its arrays become tables, or parts of the store."""
        if isinstance(kind, Rows):
            table = self._table(value, kind, "_".join((self.name, *path)))
            if changed:
                inner = path[1:]
                self.changed.append(Table(".".join(inner), kind, "_".join(inner), table))
            return "NULL" if changed else table
        if not isinstance(kind, Struct | Several):
            return self.program.number(float(value) if kind is REAL else value)
        names = kind.fields if isinstance(kind, Struct) else self.program.parts(kind, None)
        made = kind.instance_class if isinstance(kind, Struct) else None
        pad, lines = "    " * depth, []
        for name, each, part in zip(names, value, kind.types, strict=True):
            if not empty(part):
                kept = path[0] == "start" and (made, name) in self.program.written
                shown = self._initialiser(each, part, (*path, legal(name)), depth + 1, kept)
                lines.append(f"{pad}    .{legal(name)} = {shown},")
        return "\n".join(["{", *lines, f"{pad}}}"])

    def _table(self, value: Any, kind: Rows, name: str) -> str:
        if 0 in kind.shape:
            return "NULL"
        self.tables += ["", f"static const {self.program.array(kind, name)} = {{"]
        several = len(kind.shape) > 1
        for row in value if several else [value]:
            numbers = ", ".join(self.program.number(each) for each in np.ravel(row))
            text = f"    {{{numbers}}}," if several else f"    {numbers},"
            self.tables += textwrap.wrap(text, 96, subsequent_indent="    ")
        self.tables.append("};")
        return name


def kind_of(value: Any) -> Kind:
    if isinstance(value, kinds.Scalar | Struct | Several | Rows):
        return value
    return kinds.of_value(value)


def _about(unit: Unit) -> dict[str, str]:
    return {"title": plain(unit.title), "unit": unit.name, "version": __version__}


def write_unit(unit: Unit, single: bool = False) -> Written:
    return Writer(unit, single).written()
