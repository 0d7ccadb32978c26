"""Procedures that fail in different ways, for the tests of the runner; children import them."""

from __future__ import annotations

import os
from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn, Grid
from macromicro.experiments.claim import REPRODUCED, Claim
from macromicro.experiments.procedure import Lab, Procedure


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


def _named(name: str, collect: object) -> Procedure:
    return Procedure(
        name, name, ("1.1",), (), ("X1",), ("Table 1.1",), (), 1.0, collect, _claims, _draw
    )  # type: ignore[arg-type]


GOOD, RAISES, DIES = (
    _named("good", _collect),
    _named("raises", _raise),
    _named("dies", _die),
)
