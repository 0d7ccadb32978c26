"""Tables 2.1, 6.1 and 6.2."""

from __future__ import annotations

from macromicro.drawing.exhibit import Grid
from macromicro.thesis.contents import find

PROCEDURE = find("technologies")


def test_tables_carry_the_facts() -> None:
    shown = {n: draw(None) for n, draw in PROCEDURE.figures.items()}
    first, parts, last = (shown[n].body for n in ("Table 2.1", "Table 6.1", "Table 6.2"))
    assert isinstance(first, Grid) and isinstance(parts, Grid) and isinstance(last, Grid)
    assert [row[-1] for row in first.rows] == [
        "255 USD", "1500-5000 USD", "3000 USD", "4000 USD", "8000 USD",
    ]  # fmt: skip
    assert parts.rows[-1] == ("total", "255 USD") and len(parts.rows) == 7
    assert sum(float(row[1].split()[0]) for row in parts.rows[:-1]) == 255.0
    assert [row[2] for row in last.rows] == [
        "255 USD", "1500 USD", "4000 USD", "4000 USD", "8000 USD",
    ]  # fmt: skip
    assert last.rows[4][3:] == ("31.4", "250")
