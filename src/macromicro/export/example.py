"""Files beside the exported code: an example that runs one period, and a README."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from macromicro import __version__
from macromicro.export import _words, kinds
from macromicro.export._naming import legal, wrapped
from macromicro.export._routines import Routine
from macromicro.export.files import Written, kind_of
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Kind, Rows, Several, Struct, empty

CC = "cc -std=c99 -O2 -ffp-contract=off"
_ROOM = 1000  # an array of the state that is larger than this is no good on a stack


class Example:
    """A `main` that calls each function of a unit's period."""

    def __init__(self, written: Written) -> None:
        self.written, self.unit, self.program = written, written.unit, written.program
        self.state = self._state_kind()
        self.lines: list[str] = []
        self.calls: list[str] = []
        self.others: list[str] = []  # calls of other occasions, as words
        self.known: dict[str, Any] = {}

    def _state_kind(self) -> Any:
        if self.unit.state is not None:
            return kind_of(self.unit.state)
        first = self.unit.entries[0]
        return self.written.entries[0].result if first.name == "start" else None

    def text(self) -> str:
        name = self.written.name
        if self.unit.state is not None:
            kind = self.program.struct(self.state)
            if self.written.store:
                self.lines += [f"    static {kind}Store store;", f"    {kind} state;"]
                self.calls.append(f"{name}_begin(&state, &store);")
            else:
                self.lines.append(f"    {kind} state;")
                self.calls.append(f"{name}_begin(&state);")
            self.lines.append(f"    {self.calls[-1]}")
        for entry, made in zip(self.unit.entries, self.written.entries, strict=True):
            self._call(entry, made)
        head = _words.comment(
            f"One period of {name}.\n{CC} main.c {name}.c -lm -o {name} && ./{name}"
        )
        return "\n".join([
            *head, "#include <math.h>", "#include <stdio.h>", "",
            f'#include "{name}.h"', "", "int main(void)", "{",
            *wrapped(self.lines), "    return 0;", "}", "",
        ])  # fmt: skip

    def _call(self, entry: Any, made: Routine) -> None:
        given = []
        parameters = zip(made.parameters.items(), entry.arguments, strict=True)
        for (name, kind), value in parameters:
            if not empty(kind):
                given.append(self._argument(name, kind, value))
        call = f"{made.name}({', '.join(given)})"
        if entry.when:
            self.others.append(f"- {entry.when}: `{call}`")
            return
        self.calls.append(call)
        if made.result == self.state and made.result is not None:
            fresh = self.unit.state is None and entry.name == "start"
            declared = f"{self.program.struct(self.state)} " if fresh else ""
            self.lines.append(f"    {declared}state = {call};")
            return
        if made.result is None:
            self.lines.append(f"    {call};")
            return
        layout = made if isinstance(made.result, Several) else None
        out = self.program.declared(made.result, entry.name, layout=layout)
        self.lines.append(f"    const {out} = {call};")
        if isinstance(made.result, Several):
            for part, kind in zip(
                self.program.parts(made.result, made), made.result.types, strict=True
            ):
                if kind == self.state:
                    self.lines.append(f"    state = {entry.name}.{part};")
                else:
                    self._print(f"{entry.name}.{part}", kind)
        else:
            self._print(entry.name, made.result)

    def _argument(self, name: str, kind: Kind, value: Any) -> str:
        for key, given in self.unit.given.items():
            if given is value:
                return f"&{self.written.name}_{key}"
        if isinstance(kind, Struct | Several) and kind == self.state:
            return "&state"
        if kind in (REAL, WHOLE, TRUTH):
            number = self.unit.period if name == "dt" else value
            if isinstance(value, kinds.Scalar):
                number = 0.0
            return self.program.number(float(number) if kind is REAL else number)
        shown = legal(name) if name != "state" else "state_"
        if self.known.get(shown) != kind:
            if isinstance(kind, Rows):
                sizes = "".join(f"[{n or 1}]" for n in kind.shape)
                self.lines.append(f"    static const {self.program.real} {shown}{sizes};")
            else:
                start = "{0}"
                if not isinstance(value, Struct | Several):
                    start = self.program.plain(value, kind, lambda v, k: "NULL")
                declared = self.program.declared(kind, shown)
                self.lines.append(f"    const {declared} = {start};")
            self.known[shown] = kind
        return shown if isinstance(kind, Rows) else f"&{shown}"

    def _print(self, path: str, kind: Kind) -> None:
        if isinstance(kind, Struct | Several):
            names = (
                [legal(n) for n in kind.fields] if isinstance(kind, Struct)
                else self.program.parts(kind, None)
            )  # fmt: skip
            for name, part in zip(names, kind.types, strict=True):
                if kind_is_number(part):
                    self._print(f"{path}.{name}", part)
            return
        if kind_is_number(kind):
            form, cast = ("%.9g", "") if kind is REAL else ("%ld", "(long)")
            self.lines.append(f'    printf("{path} = {form}\\n", {cast}{path});')


def kind_is_number(kind: Any) -> bool:
    return kind in (REAL, WHOLE, TRUTH)


def size(kind: Kind, real: int = 8, pointer: int = 4) -> tuple[int, int]:
    """Bytes of a value in C, and its alignment."""
    if isinstance(kind, Rows):
        return pointer, pointer
    if not isinstance(kind, Struct | Several):
        bytes_ = 1 if kind is TRUTH else real
        return bytes_, bytes_
    place, most = 0, 1
    for part in kind.types:
        if not empty(part):
            number, align = size(part, real, pointer)
            place = -(-place // align) * align + number
            most = max(most, align)
    return -(-place // most) * most, most


def stack(written: Written) -> int | None:
    """Bytes of stack of the deepest chain of calls, by gcc here; None without gcc."""
    if shutil.which("gcc") is None:
        return None
    with TemporaryDirectory() as folder:
        place = Path(folder)
        (place / f"{written.name}.h").write_text(written.header)
        (place / f"{written.name}.c").write_text(written.code)
        command = ["gcc", "-std=c99", "-Os", "-fstack-usage", "-c", f"{written.name}.c"]
        done = subprocess.run(command, cwd=place, capture_output=True, check=False)
        told = list(place.glob("*.su"))
        if done.returncode or not told:
            return None
        rows = [line.split("\t") for line in told[0].read_text().splitlines()]
    own = {row[0].rpartition(":")[2]: int(row[1]) for row in rows}
    calls = {made.name: set(re.findall(r"\w+", "\n".join(made.lines))) for made in written.routines}
    deep: dict[str, int] = {}
    for made in written.routines:  # callees stand before their callers
        below = [deep[name] for name in calls[made.name] if name in deep]
        deep[made.name] = own.get(made.name, 0) + max(below, default=0)
    return max((deep[made.name] for made in written.entries), default=0)


def readme(written: Written) -> str:
    name, unit, program = written.name, written.unit, written.program
    example = Example(written)
    example.text()
    real = 4 if program.single else 8
    lines = [
        f"# {name}",
        "",
        f"{unit.title[0].upper()}{unit.title[1:]}: `{unit.name}`, exported by macromicro "
        f"{__version__} as C99. No allocation, no library but libm, {program.real} numbers.",
        "",
        f"- `{name}.h`, `{name}.c`: the code",
        "- `main.c`: an example that runs one period",
        "",
        f"    {CC} main.c {name}.c -lm -o {name}",
        "",
        "## Calls",
        "",
        "Call them in this order. The functions have no static data; all state is in the structs.",
        "",
        *(f"    {call}" for call in wrapped([f"{c}" for c in example.calls])),
        "",
        *([*example.others, ""] if example.others else []),
        "`-ffp-contract=off` prevents fused multiply-add, whose last bits would differ from "
        "Python's.",
        "",
        "## Sizes",
        "",
        "| struct | bytes, with pointers of 32 bits |",
        "|---|---|",
    ]
    text = written.header + written.code
    for kind, shown in program.structs.items():
        if not isinstance(kind, Struct | Several) or not re.search(rf"\b{shown}\b", text):
            continue
        lines.append(f"| {shown} | {size(kind, real)[0]} |")
    deep = stack(written)
    if deep is not None:
        lines += ["", f"Deepest stack: {deep} bytes, by gcc -Os on the machine that exported it."]
    return "\n".join([*lines, ""])
