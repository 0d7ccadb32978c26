"""Kernels put together: routines in the order of their calls, structs, constants."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from macromicro.columns import Meaning
from macromicro.export import kinds
from macromicro.export._sources import Source, source
from macromicro.export._statements import Routine
from macromicro.export._text import (
    camel,
    identifiers,
    legal,
    notes_of,
    plain,
    remark,
    snake,
    wrap,
)
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

    def struct(self, kind: Any, made: Routine | None = None) -> str:
        """Name of the struct of a ``NamedTuple`` or tuple; a routine's result has its own."""
        made = made if isinstance(kind, Several) else None
        key = made or kind
        if key not in self.structs:
            for part in kind.types:
                if isinstance(part, Struct | Several) and not empty(part):
                    self.struct(part)
            other = ""
            if made is not None:
                name = f"{camel(made.name)}Out"
            elif isinstance(kind, Several):
                name = "".join(str(p) if isinstance(p, Struct) else "Part" for p in kind.types)
            else:
                path, name = kind.instance_class.__module__.split("."), str(kind)
                module = camel(path[-1])
                name = name if name.startswith(module) else module + name
                other = camel(path[-2]) + name if len(path) > 1 else ""
            self.structs[key] = self._claim(name, other)
        return self.structs[key]

    def parts(self, kind: Several, layout: Any) -> list[str]:
        """Names of a tuple's parts in C: those of a routine's result if it names them."""
        if layout is not None:
            for given in ([note.name for note in layout.source.results()], layout.returned):
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
        value = float(np.float32(value)) if self.single else float(value)
        if math.isnan(value):
            return "NAN"
        if math.isinf(value):
            return "INFINITY" if value > 0 else "-INFINITY"
        if not self.single:
            return repr(value)
        shown = str(np.float32(value))
        return f"{shown}f" if "." in shown or "e" in shown else f"{shown}.0f"

    def plain(self, value: Any, kind: Kind) -> str:
        """An initialiser in braces, without arrays, or a number."""
        if isinstance(kind, Struct | Several):
            pairs = zip(value, kind.types, strict=True)
            return f"{{{', '.join(self.plain(v, k) for v, k in pairs if not empty(k))}}}"
        return (
            "NULL"
            if isinstance(kind, Rows)
            else self.number(float(value) if kind is REAL else value)
        )

    def literal(self, value: Any, kind: Kind) -> str:
        """A constant within an expression."""
        made = f"({self.struct(kind)})" if isinstance(kind, Struct | Several) else ""
        return made + self.plain(value, kind)

    def compound(self, kind: Struct, parts: list[tuple[str, str]]) -> str:
        name = self.struct(kind)
        if len(parts) <= 3:
            return f"({name}){{{', '.join(text for _, text in parts)}}}"
        return f"({name}){{{', '.join(f'.{legal(n)} = {text}' for n, text in parts)}}}"

    def array(self, kind: Rows, name: str) -> str:
        """A declaration with all sizes; 1 for one that only the caller knows."""
        sizes = "".join(f"[{n or 1}]" for n in kind.shape)
        return f"{self.real if kind.element is REAL else self.whole} {name}{sizes}"

    def declared(self, kind: Any, name: str, layout: Any = None, rows_const: bool = False) -> str:
        """A declaration without its end."""
        if isinstance(kind, Rows):
            const = "const " if rows_const else ""
            element = self.real if kind.element is REAL else self.whole
            if len(kind.shape) == 1:
                return f"{const}{element} *{name}"
            rest = "".join(f"[{n}]" for n in kind.shape[1:])
            return f"{const}{element} (*{name}){rest}"
        if isinstance(kind, Struct | Several):
            return f"{self.struct(kind, layout)} {name}"
        return f"{ {REAL: self.real, WHOLE: self.whole, TRUTH: 'bool'}[kind] } {name}"

    # Routines

    def routine(
        self,
        function: Callable[..., Any],
        types: Sequence[Kind],
        asked: tuple[Source, ast.AST] | None = None,
        name: str = "",
    ) -> Routine:
        """A kernel for arguments of given types, with everything that it calls."""
        types = kinds.widen(function, types)
        named, choose = function, choice(function)
        if choose is not None:
            chosen: Callable[..., Any] | None = choose(*types)
            if chosen is None:
                assert asked is not None
                asked[0].refuse(asked[1], f"{named.__name__} of these types", "known types")
            function = chosen
        key = (named, types)
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
        return self.declared(made.result, head, made)

    def text(self, made: Routine, static: bool) -> list[str]:
        used = identifiers(made.lines)
        idle = [f"    (void){text};" for _, _, text in made.heads() if text not in used]
        head = f"{'static ' if static else ''}{self.signature(made)}"
        return wrap([*made.source.head, head, "{", *idle, *made.lines, "}"])

    def struct_lines(self, used: set[str]) -> list[str]:
        """The structs of these names and those in them, each before its users."""
        seen = set(used)
        found: list[list[str]] = []
        for kind, name in reversed(self.structs.items()):
            if name in seen:
                found.append(["", *self._struct(kind, name)])
                seen |= identifiers(found[-1])
        return wrap([line for each in reversed(found) for line in each])

    def _struct(self, kind: Any, name: str) -> list[str]:
        if isinstance(kind, Routine):
            names, types = self.parts(kind.result, kind), kind.result.types
            notes, head = kind.source.results(), [f"/* What {kind.name} returns. */"]
        elif isinstance(kind, Several):
            names, types, notes, head = self.parts(kind, None), kind.types, [], []
        else:
            names, types = [legal(n) for n in kind.fields], kind.types
            notes = list(notes_of(kind.instance_class).values())
            about = (kind.instance_class.__doc__ or "").partition("\n")[0]
            own = not about.startswith(f"{kind}(")  # Python's own text
            head = [f"/* {plain(about)} */"] if about and own else []
        if len(notes) != len(names):
            notes = [Meaning()] * len(names)
        body = []
        for each, part, note in zip(names, types, notes, strict=True):
            if empty(part):
                continue
            about, const = remark(note), False
            if isinstance(part, Rows):
                const = not isinstance(kind, Struct) or (
                    (kind.instance_class, each.rstrip("_")) not in self.written
                )
                size = f"{' x '.join(map(str, part.shape))} values"
                about = f"{about}; {size}" if about else size
            shown = f"    {self.declared(part, each, rows_const=const)};"
            body.append(f"{shown} /* {about} */" if about else shown)
        return [*head, "typedef struct {", *body, f"}} {name};"]
