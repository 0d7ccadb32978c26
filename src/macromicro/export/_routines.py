"""A kernel as a function in C, statement by statement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from macromicro.export._expr import PLACE, POINTER
from macromicro.export._naming import legal
from macromicro.export._scopes import scopes
from macromicro.export._sources import Source
from macromicro.export._statements import INDENT, Statements
from macromicro.export.kinds import Kind, Several, Struct, empty

if TYPE_CHECKING:
    from macromicro.export._program import Program


class Routine(Statements):
    def __init__(
        self, program: Program, source: Source, types: tuple[Kind, ...], name: str
    ) -> None:
        super().__init__(program, source)
        self.name = name
        self.parameters = dict(zip(source.parameters, types, strict=True))
        self.result: Any = None
        self.returned: list[str] = []
        self.lines: list[str] = []
        self.scopes = scopes(source.body, source.parameters)
        self.local = set(source.parameters) | {n for n, k in self.scopes.stores.items() if k}
        self._given: list[str] = []

    def translate(self) -> None:
        """Find all types, then write the lines."""
        found: dict[str, Kind] = {}
        for _ in range(10):
            self._begin(found)
            lines = self._block(self.source.body, 1)
            if self.kinds == found and self._result == self.result:
                self.lines = [*self._given, *lines]
                return
            found, self.result = dict(self.kinds), self._result
        self.refuse(self.source.node, self.name, "variables that keep their types")

    def _begin(self, found: dict[str, Kind]) -> None:
        self.kinds = {**found, **self.parameters}
        self.forms, self.layouts, self._given = {}, {}, []
        self.taken = {legal(name) for name in self.local}
        self.named = {name: legal(name) for name in self.local}
        self.steady = {n for n in self.parameters if not self.scopes.stores[n]}
        self._declared: set[str] = set()
        self._result: Any = None
        for name, kind in self.parameters.items():
            if not isinstance(kind, Struct | Several) or empty(kind):
                continue
            self.forms[name] = POINTER
            if self.scopes.stores[name]:
                self.forms[name] = PLACE
                self.named[name] = legal(name)
                declared = self.program.declared(kind, legal(name))
                self._given.append(f"{INDENT}{declared} = *given_{name};")

    def heads(self) -> list[tuple[str, Kind, str]]:
        """Parameters in C: name in Python, type, name in C."""
        return [
            (n, k, f"given_{n}" if self.scopes.stores[n] and isinstance(k, Struct | Several)
             else legal(n))
            for n, k in self.parameters.items() if not empty(k)
        ]  # fmt: skip
