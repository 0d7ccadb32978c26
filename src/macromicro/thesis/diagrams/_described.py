"""Description and caption of a diagram."""

from __future__ import annotations

from typing import NamedTuple

from macromicro.drawing.diagram import Diagram
from macromicro.drawing.flow import Flow


class Described(NamedTuple):
    body: Diagram | Flow
    caption: str


def number(value: float) -> str:
    """A parameter as a diagram shows it, such as "0.364" or "-1.95833"."""
    return f"{value:.6g}"
