"""The variables of an FMU: numbers of a unit's parameters, inputs, outputs and state."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.columns import Meaning, meaning
from macromicro.errors import InputError, MacromicroError
from macromicro.export import _words as words
from macromicro.export import kinds
from macromicro.export._naming import legal
from macromicro.export._routines import Routine
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
        notes = words.results(made.source)
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
            declared = f"{self.program.real} {field}" + "".join(f"[{n or 1}]" for n in kind.shape)
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
            notes = words.fields(kind.instance_class) if isinstance(kind, Struct) else {}
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
        unit, told = _known(note.unit), words.said(note)
        self.variables.append(Variable(name, causality, path, start, unit, told, kind is not REAL))


def _known(unit: str) -> str:
    """A unit that other tools know; "" for any other."""
    try:
        size(unit)
    except (MacromicroError, ValueError, KeyError):
        return ""
    return "" if unit in ("1", "-") else unit
