"""Kernels put together: routines in the order of their calls, structs, constants."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from macromicro.export import _words, kinds
from macromicro.export._naming import camel, identifiers, legal, snake, wrapped
from macromicro.export._routines import Routine
from macromicro.export._sources import Source, source
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty
from macromicro.kernel import choice


class Program:
    def __init__(self, single: bool = False) -> None:
        self.single = single
        self.real = "float" if single else "double"
        self.whole = "int32_t" if single else "int64_t"
        self.routines: dict[tuple[Any, ...], Routine] = {}
        self.order: list[Routine] = []
        self.structs: dict[Any, str] = {}
        self.constants: dict[str, str] = {}
        self.helpers: set[str] = set()
        self.written: set[tuple[Any, str]] = set()
        self._names: set[str] = set()
        self._open: list[tuple[Any, ...]] = []
        self._sizes: dict[str, Any] = {}

    # Names

    def _claim(self, name: str, other: str = "") -> str:
        free, number = name, 2
        if free in self._names and other:
            free = other
        base = free
        while free in self._names:
            free, number = f"{base}_{number}", number + 1
        self._names.add(free)
        return free

    def struct(self, kind: Any) -> str:
        if isinstance(kind, Several):
            return self.tuple_name(kind, None)
        if kind not in self.structs:
            for part in kind.types:
                if isinstance(part, Struct | Several) and not empty(part):
                    self.struct(part)
            made = kind.instance_class
            module = camel(made.__module__.rpartition(".")[2])
            name = made.__name__
            name = name if name.startswith(module) else module + name
            package = camel(made.__module__.split(".")[-2]) if "." in made.__module__ else ""
            self.structs[kind] = self._claim(name, package + name)
        return self.structs[kind]

    def tuple_name(self, kind: Several, layout: Any) -> str:
        """Name of the struct of a plain tuple, or of a routine's result."""
        key = kind if layout is None else ("result", layout.name)
        if key not in self.structs:
            for part in kind.types:
                if isinstance(part, Struct | Several) and not empty(part):
                    self.struct(part)
            if layout is not None:
                name = camel(layout.name) + "Out"
                self._sizes[layout.name] = layout
            else:
                name = "".join(str(p) if isinstance(p, Struct) else "Part" for p in kind.types)
            self.structs[key] = self._claim(name)
        return self.structs[key]

    def parts(self, kind: Several, layout: Any) -> list[str]:
        if layout is not None:
            told = [note.name for note in _words.results(layout.source)]
            given = told if len(told) == len(kind.types) and all(told) else layout.returned
            if len(given) == len(kind.types) == len(set(given)) and all(given):
                return [legal(name) for name in given]
        found: list[str] = []
        for place, part in enumerate(kind.types):
            name = f"part{place}"
            if isinstance(part, Struct):
                name = snake(part.instance_class.__name__)
            found.append(legal(f"{name}_{place}" if name in found else name))
        return found

    def constant(self, name: str, home: str, value: float) -> str:
        module = home.rpartition(".")[2].strip("_")
        shown = f"{module}_{name.strip('_')}".upper() if module != "math" else name.upper()
        text = self.number(value)
        base, number = shown, 2
        while self.constants.get(shown, text) != text:
            shown, number = f"{base}_{number}", number + 1
        self.constants[shown] = text
        return shown

    def helper(self, name: str) -> str:
        self.helpers.add(name)
        return name

    def math(self, name: str) -> str:
        return f"{name}f" if self.single else name

    # Values

    def number(self, value: Any) -> str:
        """A number in C, exactly."""
        if isinstance(value, bool | np.bool_):
            return "true" if value else "false"
        if isinstance(value, int | np.integer):
            return str(int(value))
        value = float(value)
        if math.isnan(value):
            return "NAN"
        if math.isinf(value):
            return "INFINITY" if value > 0 else "-INFINITY"
        if self.single:
            shown = repr(float(np.float32(value)))
            short = str(np.float32(value))
            shown = short if "." in short or "e" in short else f"{short}.0"
            return f"{shown}f" if np.isfinite(np.float32(value)) else (
                "INFINITY" if value > 0 else "-INFINITY")  # fmt: skip
        return repr(value)

    def plain(self, value: Any, kind: Kind, tables: Callable[[Any, Kind], str] | None) -> str:
        """An initialiser in braces, or a number."""
        if isinstance(kind, Rows):
            if tables is None:
                return "NULL"
            return tables(value, kind)
        if isinstance(kind, Struct | Several):
            shown = [
                self.plain(v, k, tables)
                for v, k in zip(value, kind.types, strict=True)
                if not empty(k)
            ]
            return f"{{{', '.join(shown)}}}"
        return self.number(float(value) if kind is REAL else value)

    def literal(self, value: Any, kind: Kind) -> str:
        """A value of a constant ``NamedTuple`` or tuple within an expression."""
        return f"({self.struct(kind)}){self.plain(value, kind, None)}"

    def compound(self, kind: Struct, parts: list[tuple[str, str]]) -> str:
        name = self.struct(kind)
        if len(parts) <= 3:
            return f"({name}){{{', '.join(text for _, text in parts)}}}"
        return f"({name}){{{', '.join(f'.{legal(n)} = {text}' for n, text in parts)}}}"

    def declared(self, kind: Any, name: str, layout: Any = None, rows_const: bool = False) -> str:
        """A declaration without its end."""
        if isinstance(kind, Rows):
            const = "const " if rows_const else ""
            element = self.real if kind.element is REAL else self.whole
            if len(kind.shape) == 1:
                return f"{const}{element} *{name}"
            rest = "".join(f"[{n}]" for n in kind.shape[1:])
            return f"{const}{element} (*{name}){rest}"
        types = {REAL: self.real, WHOLE: self.whole, TRUTH: "bool"}
        if isinstance(kind, kinds.Scalar):
            shown = types[kind]
        elif isinstance(kind, Several):
            shown = self.tuple_name(kind, layout)
        else:
            shown = self.struct(kind)
        return f"{shown} {name}"

    # Routines

    def routine(
        self,
        function: Callable[..., Any],
        types: tuple[Kind, ...],
        asked: tuple[Source, ast.AST] | None = None,
        name: str = "",
    ) -> Routine:
        """A kernel for arguments of given types, with everything that it calls."""
        choose = choice(function)
        if choose is not None:
            chosen = choose(*types)
            if chosen is None:
                assert asked is not None
                asked[0].refuse(asked[1], f"{function.__name__} of these types", "known types")
            named, function = function, chosen
        else:
            named = function
        key = (function, types) if choose is None else (named, types)
        if key in self._open:
            it = source(function)
            it.refuse(it.node, f"{function.__name__} calls itself", "a loop")
        if key not in self.routines:
            free = name or self._function_name(named)
            made = Routine(self, source(function), types, free)
            self._open.append(key)
            made.translate()
            self._open.pop()
            self.routines[key] = made
            self.order.append(made)
        return self.routines[key]

    def _function_name(self, function: Callable[..., Any]) -> str:
        path = function.__module__.split(".")
        inner = [p.strip("_") for p in function.__qualname__.split(".") if p != "<locals>"]
        module = path[-1].strip("_")
        base = "_".join([module, *inner])
        return self._claim(base, f"{path[-2]}_{base}" if len(path) > 1 else "")

    # Text

    def signature(self, made: Routine) -> str:
        shown = []
        for name, kind, text in made.heads():
            if isinstance(kind, Rows):
                shown.append(self.declared(kind, text, rows_const=name not in made.written))
            elif isinstance(kind, Struct | Several):
                shown.append(f"const {self.declared(kind, f'*{text}')}")
            else:
                shown.append(self.declared(kind, text))
        head = f"{made.name}({', '.join(shown) or 'void'})"
        if made.result is None:
            return f"void {head}"
        layout = made if isinstance(made.result, Several) else None
        return self.declared(made.result, head, layout=layout)

    def text(self, made: Routine, static: bool) -> list[str]:
        used = identifiers(made.lines)
        idle = [f"    (void){text};" for _, _, text in made.heads() if text not in used]
        head = f"{'static ' if static else ''}{self.signature(made)}"
        return wrapped([*made.source.head, head, "{", *idle, *made.lines, "}"])

    def struct_lines(self, used: set[str]) -> list[str]:
        """The structs of these names and those in them, each before its users."""
        seen = set(used)
        found: list[list[str]] = []
        for kind, name in reversed(self.structs.items()):
            if name in seen:
                found.append(["", *self._struct(kind, name)])
                seen |= identifiers(found[-1])
        return wrapped([line for each in reversed(found) for line in each])

    def _struct(self, kind: Any, name: str) -> list[str]:
        told: dict[str, str] = {}
        if isinstance(kind, tuple):
            made = self._sizes[kind[1]]
            names, types = self.parts(made.result, made), made.result.types
            known = _words.results(made.source)
            if len(known) == len(names):
                told = {n: _words.said(note) for n, note in zip(names, known, strict=True)}
            head = [f"/* What {made.name} returns. */"]
        elif isinstance(kind, Several):
            names, types, head = self.parts(kind, None), kind.types, []
        else:
            names, types = [legal(n) for n in kind.fields], kind.types
            told = {
                legal(n): _words.said(note)
                for n, note in _words.fields(kind.instance_class).items()
            }
            about = (kind.instance_class.__doc__ or "").partition("\n")[0]
            own = not about.startswith(f"{kind.instance_class.__name__}(")  # Python's own text
            head = [f"/* {_words.plain(about)} */"] if about and own else []
        body = []
        for each, part in zip(names, types, strict=True):
            if empty(part):
                continue
            const = isinstance(part, Rows) and not (
                isinstance(kind, Struct) and (kind.instance_class, each.rstrip("_")) in self.written
            )
            note = told.get(each, "")
            if isinstance(part, Rows):
                size = " x ".join(str(n) for n in part.shape)
                note = f"{note}; {size} values" if note else f"{size} values"
            shown = f"    {self.declared(part, each, rows_const=const)};"
            body.append(f"{shown} /* {note} */" if note else shown)
        return [*head, "typedef struct {", *body, f"}} {name};"]
