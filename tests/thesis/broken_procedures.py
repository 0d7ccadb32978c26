"""Procedures that fail in different ways, for the tests of the runner; children import them."""

from __future__ import annotations

import os
from collections.abc import Iterator

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


def _draw(data: int) -> Iterator[Drawn]:
    yield Drawn("Table 1.1", "Seed", "The seed.", Grid(("seed",), [(str(data),)]), ("X1",))


def _breaks(data: int) -> Iterator[Drawn]:
    yield from _draw(data)
    raise ValueError("no pencil")


def _unfit(data: int) -> Iterator[Drawn]:
    """The second of three is nothing that can be rendered."""
    for number in ("Table 1.1", "1.2", "Table 1.3"):
        body = None if number == "1.2" else Grid(("seed",), [(str(data),)])
        yield Drawn(number, "Seed", "The seed.", body, ("X1",))  # type: ignore[arg-type]


def _named(
    name: str, collect: object, draw: object = _draw, figures: tuple[str, ...] = ("Table 1.1",)
) -> Procedure:
    return Procedure(name, name, ("1.1",), (), ("X1",), figures, (), 1.0, collect, _claims, draw)  # type: ignore[arg-type]


THREE = ("Table 1.1", "1.2", "Table 1.3")
GOOD, RAISES, DIES, BREAKS, UNFIT, NO_DIAGRAM = (
    _named("good", _collect),
    _named("raises", _raise),
    _named("dies", _die),
    _named("breaks", _collect, _breaks, THREE),
    _named("unfit", _collect, _unfit, THREE),
    _named("no-diagram", _collect)._replace(diagrams=("9.9", "4.3")),
)
