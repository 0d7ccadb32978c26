"""A figure that a notebook shows, though it belongs to no window. Imports matplotlib."""

from __future__ import annotations

from matplotlib.figure import Figure

from macromicro.drawing.files import encoded


class Shown(Figure):
    """A figure of matplotlib; where it is the last value of a notebook's cell, it is drawn."""

    def _repr_png_(self) -> bytes:
        return encoded(self)
