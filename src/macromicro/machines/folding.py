"""Kernels over the stages of a machine, each of its own types: one closure a stage."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from macromicro.kernel import kernel

Kernel = Callable[..., Any]


def fold(make: Callable[[int, Kernel], Kernel], count: int, end: Kernel) -> Kernel:
    """A kernel over all stages: ``make(k, rest)`` is that of the stage k and those after it.

    The compiler sees plain calls on tuples that get shorter, so each stage keeps its own types.
    """
    made = end
    for k in reversed(range(count)):
        made = kernel(make(k, made))
    return made


@kernel
def empty(*given: Any) -> tuple[()]:
    """The end of a fold that makes a tuple."""
    return ()


@kernel
def empty_pair(*given: Any) -> tuple[tuple[()], tuple[()]]:
    """The end of a fold that makes two tuples."""
    return (), ()


@kernel
def empty_and_false(*given: Any) -> tuple[tuple[()], bool]:
    """The end of a fold that makes a tuple and asks whether one entry is so."""
    return (), False


@kernel
def nothing(*given: Any) -> None:
    """The end of a fold that writes."""
