"""Procedures that fail in different ways, for the tests of the runner; children import them."""

from __future__ import annotations

import os
from collections.abc import Callable

from macromicro.drawing import style
from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.thesis.claims import REPRODUCED, Claim
from macromicro.thesis.procedure import Lab, Procedure


def _collect(lab: Lab) -> int:
    return lab.seed


def _raise(lab: Lab) -> int:
    raise ValueError("the wire broke")


def _die(lab: Lab) -> int:
    os._exit(9)


def _claims(data: int) -> list[Claim]:
    return [Claim("X1", "1.1", "the seed", 7.0, float(data), "", REPRODUCED)]


def _draw(data: int) -> Drawn:
    return Drawn("Seed", "The seed.", Grid(("seed",), [(str(data),)]), ("X1",))


def _breaks(data: int) -> Drawn:
    raise ValueError("no pencil")


def _unfit(data: int) -> Drawn:
    """Nothing that can be rendered."""
    return Drawn("Seed", "The seed.", None, ("X1",))  # type: ignore[arg-type]


def _pictured(data: int) -> Drawn:
    return Drawn("Seed", "The seed.", style.new(2.0, 1)[0], ("X1",))


def _named(name: str, collect: Callable[[Lab], int]) -> Procedure:
    figures = {"Table 1.1": _draw}
    return Procedure(name, name, ("1.1",), (), ("X1",), figures, (), 1.0, collect, _claims)


def _second(name: str, draw: Callable[[int], Drawn]) -> Procedure:
    """The second of three figures is drawn so."""
    figures = {"Table 1.1": _draw, "1.2": draw, "Table 1.3": _draw}
    return _named(name, _collect)._replace(figures=figures)


GOOD, RAISES, DIES, BREAKS, UNFIT, PICTURED, NO_DIAGRAM = (
    _named("good", _collect),
    _named("raises", _raise),
    _named("dies", _die),
    _second("breaks", _breaks),
    _second("unfit", _unfit),
    _second("pictured", _pictured),
    _named("no-diagram", _collect)._replace(diagrams=("9.9", "4.3")),
)
