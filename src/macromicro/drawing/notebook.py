"""Figures that a notebook shows without pyplot. Imports matplotlib."""

from __future__ import annotations

from matplotlib.figure import Figure

from macromicro.drawing.files import encode


class NotebookFigure(Figure):
    """A matplotlib figure that a notebook draws as the value of a cell."""

    def _repr_png_(self) -> bytes:
        return encode(self)
