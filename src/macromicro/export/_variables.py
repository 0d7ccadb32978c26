"""The variables of an FMU: numbers of a unit's parameters, inputs, outputs and state."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from macromicro.columns import Meaning, meaning
from macromicro.errors import InputError, MacromicroError
from macromicro.export import _words as words
from macromicro.export import kinds
from macromicro.export._naming import legal
from macromicro.export.files import Written, kind_of
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty
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
    def __init__(self, written: Written) -> None:
        self.written, self.unit, self.program = written, written.unit, written.program
        self.variables: list[Variable] = []
        self.fields: list[tuple[Any, str]] = []  # of the model: type or declaration, name
        self.starts: list[tuple[str, Any, Kind]] = []  # inputs: field, example, type
        self.calls: list[Call] = []
        self.state = self._state_kind()
        for key, value in self.unit.given.items():
            self.fields.append((kind_of(value), f"given_{key}"))
            self._leaves(key, PARAMETER, f"given_{key}", value, kind_of(value))
        for entry, made in zip(self.unit.entries, written.entries, strict=True):
            if not entry.when:
                self._entry(entry, made)
        if self.state is not None:
            self.fields.insert(0, (self.state, "state"))
            outputs = [v for v in self.variables if v.causality == OUTPUT]
            self._leaves("state", LOCAL if outputs else OUTPUT, "state", None, self.state)
        if not [v for v in self.variables if v.causality == OUTPUT]:
            accepted = "a unit whose functions give numbers"
            raise InputError("WHAT", self.unit.name, accepted)

    def _state_kind(self) -> Any:
        if self.unit.state is not None:
            return kind_of(self.unit.state)
        first = self.unit.entries[0]
        return self.written.entries[0].result if first.name == "start" else None

    def _entry(self, entry: Any, made: Any) -> None:
        given = []
        for (name, kind), value in zip(made.parameters.items(), entry.arguments, strict=True):
            if not empty(kind):
                given.append(self._argument(name, kind, value, made))
        text = f"{made.name}({', '.join(given)})"
        if made.result == self.state and self.state is not None:
            self.calls.append(Call(entry.name, text, ""))
            return
        moves = None
        self.fields.append((made, f"out_{entry.name}"))
        others = [e for e in self.unit.entries if e.name != "start" and not e.when]
        single = len(others) == 1 or entry.name == "measure"
        prefix = "" if single else f"{entry.name}"
        if isinstance(made.result, Several):
            names = self.program.parts(made.result, made)
            told = words.results(made.source)
            told = told if len(told) == len(names) else [NOTHING] * len(names)
            for name, kind, note in zip(names, made.result.types, told, strict=True):
                if kind == self.state:
                    moves = name
                    continue
                shown = ".".join(filter(None, (prefix, name.rstrip("_"))))
                self._leaves(shown, OUTPUT, f"out_{entry.name}.{name}", None, kind, note)
        else:
            (note,) = words.results(made.source)
            shown = prefix or ("" if isinstance(made.result, Struct) else entry.name)
            shown = "true" if entry.name == "show" else shown
            field = f"out_{entry.name}"
            self._leaves(shown, OUTPUT, field, None, made.result, note)
        self.calls.append(Call(entry.name, text, moves, self.unit.memory))

    def _argument(self, name: str, kind: Kind, value: Any, made: Any) -> str:
        for key, given in self.unit.given.items():
            if given is value:
                return f"&m->given_{key}"
        if self.state is not None and kind == self.state:
            return "&m->state" if isinstance(kind, Struct | Several) else "m->state"
        if kind is REAL and name in ("dt", "t"):
            return "PERIOD" if name == "dt" else "m->time"
        if kind is WHOLE:
            return str(0 if isinstance(value, kinds.Scalar) else int(value))
        field = f"in_{legal(name)}"
        if (kind, field) not in self.fields:
            self.fields.append((kind, field))
            if isinstance(kind, Rows):
                for k in range(kind.shape[-1] or 0):
                    noise = "standard normal draw of the sensors' noise"
                    self.variables.append(
                        Variable(f"{name}[{k}]", INPUT, f"{field}[0][{k}]", 0.0, "", noise)
                    )
            elif name not in self.unit.memory:
                example = 0.0 if isinstance(value, kinds.Scalar) else value
                self.starts.append((field, example, kind))
                note = meaning(made.source.hints.get(name))
                self._leaves(name, INPUT, field, example, kind, note)
        if isinstance(kind, Struct | Several):
            return f"&m->{field}"
        return f"m->{field}"

    def _leaves(
        self, name: str, causality: str, path: str, value: Any, kind: Kind, note: Meaning = NOTHING
    ) -> None:
        if isinstance(kind, Struct | Several):
            fields = (
                list(kind.fields) if isinstance(kind, Struct) else self.program.parts(kind, None)
            )
            told = words.fields(kind.instance_class) if isinstance(kind, Struct) else {}
            for place, (field, part) in enumerate(zip(fields, kind.types, strict=True)):
                example = None if value is None else value[place]
                if not empty(part):
                    inner = f"{path}.{legal(field)}"
                    full = f"{name}.{field}" if name else field
                    self._leaves(full, causality, inner, example, part, told.get(field, NOTHING))
            return
        if kind not in (REAL, WHOLE, TRUTH):
            return
        whole = kind is not REAL
        clock = name.rpartition(".")[2] == "t" and note.unit == "s"
        if clock or (causality in (INPUT, PARAMETER) and whole):
            return
        start = None if causality in (OUTPUT, LOCAL) else float(value)
        if start is not None and not math.isfinite(start):
            return
        if name in {each.name for each in self.variables}:
            name = f"out.{name}"  # what goes in has that name
        self.variables.append(
            Variable(name, causality, path, start, _known(note.unit), words.said(note), whole)
        )


def _known(unit: str) -> str:
    """A unit that other tools know; "" for any other."""
    try:
        size(unit)
    except (MacromicroError, ValueError, KeyError):
        return ""
    return "" if unit in ("1", "-") else unit
