"""Exhibits: how they are cited and named."""

from __future__ import annotations

import pytest

from macromicro.drawing.exhibit import TABLE, Drawn, Grid, render


@pytest.mark.parametrize(
    ("number", "label", "name"),
    [
        ("4.8", "Figure 4.8", "figure-4-8"),
        ("A.1", "Figure A.1", "figure-a-1"),
        ("Table 2.1", "Table 2.1", "table-2-1"),
        ("Table 6.2 (plot)", "Table 6.2 (plot)", "table-6-2-plot"),
        ("(2.1)", "Equation (2.1)", "equation-2-1"),
    ],
)
def test_label_and_name(number: str, label: str, name: str) -> None:
    made = render(number, Drawn("", "", Grid(("a",), [("1",)])))
    assert (made.label, made.name, made.kind) == (label, name, TABLE)
