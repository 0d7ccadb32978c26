"""Figures of the package are drawn in notebooks, without pyplot and its inline backend."""

from __future__ import annotations

from macromicro.drawing.style import new
from macromicro.hysteresis import Preisach, pictures
from macromicro.plant.phase import Phase, table


def test_a_notebook_gets_a_picture() -> None:
    """IPython asks objects for `_repr_png_`."""
    figure, _ = new(2.0, 1)
    assert figure._repr_png_().startswith(b"\x89PNG")
    plane = pictures.draw_plane(Preisach(table(Phase())))
    assert plane._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
