"""Exported C, compiled and called from Python, beside the kernels that it came from."""

from __future__ import annotations

import copy
import ctypes
import math
import re
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.export import kinds
from macromicro.export._program import Program
from macromicro.export._statements import Routine
from macromicro.export._text import legal
from macromicro.export.files import Written
from macromicro.export.kinds import REAL, TRUTH, WHOLE, Rows, Several, Struct, empty

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-ffp-contract=off")
CC = shutil.which("cc")


def built(written: Written, folder: Path, *, level: str = "-O1") -> ctypes.CDLL:
    """The code as a library in which every function can be called."""
    assert CC is not None, "a C compiler is needed: make compiler"
    (folder / f"{written.name}.h").write_text(written.header)
    code = re.sub(r"^static (?!inline|const)", "", written.code, flags=re.MULTILINE)
    (folder / f"{written.name}.c").write_text(code)
    library = folder / f"{written.name}.so"
    command = [
        CC,
        *FLAGS,
        level,
        "-fPIC",
        "-shared",
        f"{written.name}.c",
        "-o",
        str(library),
        "-lm",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))


class Bound:
    """Types of a program for ctypes."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.real = ctypes.c_float if program.single else ctypes.c_double
        self.whole = ctypes.c_int32 if program.single else ctypes.c_int64
        self.made: dict[Any, Any] = {}
        self.alive: list[Any] = []

    def names(self, kind: Any, layout: Any = None) -> list[str]:
        if isinstance(kind, Struct):
            return [legal(name) for name in kind.fields]
        return self.program.parts(kind, layout)

    def type(self, kind: Any, layout: Any = None) -> Any:
        if isinstance(kind, Rows):
            return ctypes.c_void_p
        if not isinstance(kind, Struct | Several):
            return {REAL: self.real, WHOLE: self.whole, TRUTH: ctypes.c_bool}[kind]
        key = (kind, layout)
        if key not in self.made:
            fields = [
                (name, self.type(part))
                for name, part in zip(self.names(kind, layout), kind.types, strict=True)
                if not empty(part)
            ]
            self.made[key] = type("S", (ctypes.Structure,), {"_fields_": fields})
        return self.made[key]

    def give(self, value: Any, kind: Any) -> Any:
        """A value for C; arrays stay where they are."""
        if isinstance(kind, Rows):
            wanted = {REAL: self.real, WHOLE: self.whole}[kind.element]
            plain = np.ascontiguousarray(value, dtype=np.dtype(wanted)).view(np.ndarray)
            self.alive.append(plain)
            return plain.ctypes.data if plain.size else None
        if not isinstance(kind, Struct | Several):
            return self.type(kind)(value)
        made = self.type(kind)()
        for name, each, part in zip(self.names(kind), value, kind.types, strict=True):
            if not empty(part):
                setattr(made, name, self.give(each, part))
        return made

    def take(self, found: Any, kind: Any, layout: Any = None) -> Any:
        """What C gave, as nested tuples; arrays as None."""
        if isinstance(kind, Rows):
            return None
        if not isinstance(kind, Struct | Several):
            return getattr(found, "value", found)
        return tuple(
            () if empty(part) else self.take(getattr(found, name), part)
            for name, part in zip(self.names(kind, layout), kind.types, strict=True)
        )

    def call(self, library: ctypes.CDLL, made: Routine, values: dict[str, Any]) -> Any:
        """The result of an exported function."""
        function = getattr(library, made.name)
        layout = made if isinstance(made.result, Several) else None
        function.restype = None if made.result is None else self.type(made.result, layout)
        given, types = [], []
        for name, kind, _ in made.heads():
            value = self.give(values[name], kind)
            pointed = isinstance(kind, Struct | Several)
            types.append(ctypes.POINTER(self.type(kind)) if pointed else self.type(kind))
            given.append(ctypes.byref(value) if pointed else value)
            self.alive.append(value)
        function.argtypes = types
        found = function(*given)
        return None if made.result is None else self.take(found, made.result, layout)


def flat(value: Any) -> list[Any]:
    """Numbers of nested tuples, without arrays."""
    if isinstance(value, tuple):
        return [each for part in value for each in flat(part)]
    return [] if value is None or isinstance(value, np.ndarray) else [value]


def bits(value: Any) -> list[bytes]:
    """Numbers as bytes; one NaN is as good as another."""
    return [
        b"nan" if math.isnan(float(each)) else struct.pack("=d", float(each))
        for each in flat(value)
    ]


class Strict(np.ndarray):  # type: ignore[type-arg]
    """An array that knows no index below 0, as C."""

    def __getitem__(self, key: Any) -> Any:
        self._check(key)
        return super().__getitem__(key)

    def __setitem__(self, key: Any, value: Any) -> None:
        self._check(key)
        super().__setitem__(key, value)

    def _check(self, key: Any) -> None:
        for each in key if isinstance(key, tuple) else (key,):
            if isinstance(each, int | np.integer) and each < 0:
                raise IndexError("below 0")


def strict(value: Any) -> Any:
    """A copy whose arrays are strict."""
    if isinstance(value, np.ndarray):
        return np.array(value, copy=True, order="C").view(Strict)
    if isinstance(value, tuple):
        parts = [strict(each) for each in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    return copy.copy(value)


def arrays(value: Any) -> list[Any]:
    """All arrays within."""
    if isinstance(value, np.ndarray):
        return [value]
    if isinstance(value, tuple | list):
        return [found for each in value for found in arrays(each)]
    return []


__all__ = ["Bound", "arrays", "bits", "built", "flat", "kinds", "strict"]
