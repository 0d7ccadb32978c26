"""The package's compiled Preisach model beside the same algorithm in C.

Two inputs of two million samples on a 101 x 101 table: a modulated sine, and white noise,
which reverses at two of three samples. Both sides do the same operations in the same order.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np
from compiling import NATIVE, PLAIN, library
from loops import alternating

from macromicro.hysteresis import FodTable, Preisach, fresh, from_density
from macromicro.hysteresis.everett import Everett
from macromicro.hysteresis.invert import follow
from macromicro.kernel import compiled

SAMPLES = 2_000_000
ROWS = 4096


class Row(NamedTuple):
    """Input; samples/s (median; the best) of `Preisach.run` with its checks and scaling, of
    its kernel alone, of C for any and for this processor; the largest difference of outputs."""

    signal: str
    run: tuple[float, float]
    kernel: tuple[float, float]
    c: tuple[float, float]
    c_native: tuple[float, float]
    difference: float


def inputs(samples: int = SAMPLES) -> dict[str, Any]:
    """Within 0 to 1."""
    t = np.arange(samples)
    return {
        "smooth": 0.5 + 0.5 * np.sin(0.01 * t) * np.cos(1.3e-4 * t),
        "random": np.random.default_rng(0).random(samples),
    }


def table() -> Everett:
    """Random relay weights."""
    weights = np.tril(np.random.default_rng(0).random((100, 100)))
    return from_density(weights, 0.0, 0.01, 101)


def in_c(place: Path, t: Everett) -> Callable[[Any, Any], int]:
    """`preisach.c` from a compiled library: inputs and outputs to the samples done."""
    function = ctypes.CDLL(str(place)).preisach
    real, whole, array = ctypes.c_double, ctypes.c_long, ctypes.c_void_p
    function.argtypes = [real, real, whole, array, array, whole, array, whole, array]
    function.restype = whole
    stack = np.zeros((ROWS, 4))

    def run(u: Any, out: Any) -> int:
        done: int = function(
            t.lo, t.step, t.n, t.values.ctypes.data, u.ctypes.data, len(u),
            stack.ctypes.data, ROWS, out.ctypes.data,
        )  # fmt: skip
        return done

    return run


def in_package(t: Everett) -> Callable[[Any, Any], int]:
    """The same of the package's kernel."""

    def run(u: Any, out: Any) -> int:
        _, done = compiled(follow)(t, fresh(t, t.lo, ROWS), u, out, 0, 1.0, 0.0)
        return int(done)

    return run


def outputs(run: Callable[[Any, Any], int], u: Any) -> Any:
    """What `run` gives along `u`; raises RuntimeError when its stack was too small."""
    out = np.empty_like(u)
    if run(u, out) != len(u):
        raise RuntimeError(f"the stack of {ROWS} corners is full")
    return out


def measure(folder: Path, repeats: int = 11) -> list[Row]:
    """Both inputs; raises NoCompilerError without a C compiler."""
    t = table()
    whole, kernel = Preisach(FodTable.from_everett(t)), in_package(t)
    plain = in_c(library("preisach.c", folder, PLAIN), t)
    native = in_c(library("preisach.c", folder, NATIVE, "preisach_native"), t)
    found = []
    for name, u in inputs().items():
        out = np.empty_like(u)

        def asked(u: Any = u) -> Any:
            whole.reset()
            return whole.run(u)

        mine = outputs(kernel, u)
        others = (asked(), outputs(plain, u), outputs(native, u))
        difference = max(float(np.abs(mine - other).max()) for other in others)
        kernels = [lambda k=k, u=u, o=out: k(u, o) for k in (kernel, plain, native)]
        times = alternating((asked, *kernels), repeats)
        rates = [(len(u) / median(t), len(u) / min(t)) for t in times]
        found.append(Row(name, rates[0], rates[1], rates[2], rates[3], difference))
    return found
