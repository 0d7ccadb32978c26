"""Titles and captions as data."""

from __future__ import annotations

import pytest

from macromicro.drawing.exhibit import Grid
from macromicro.thesis import all_procedures
from macromicro.thesis.claims import STATEMENTS
from macromicro.thesis.contents import CAPTIONS, caption

TABLE = Grid(("part",), [("wire",)])


def test_each_figure_has_a_caption_and_each_caption_a_figure() -> None:
    drawn = [number for p in all_procedures() for number in p.figures]
    assert list(CAPTIONS) == drawn


def test_captions_name_claims_of_the_list() -> None:
    assert {name for c in CAPTIONS.values() for name in c.claims} <= set(STATEMENTS)


def test_a_caption_takes_exactly_its_values() -> None:
    found = caption("D.6", TABLE, points=12)
    assert found.caption.startswith("The 12 points (M_k, m_k, f) as measured")
    with pytest.raises(KeyError, match="points"):
        caption("D.6", TABLE)
    with pytest.raises(KeyError, match="no placeholder for: rows"):
        caption("D.6", TABLE, points=12, rows=1)
    with pytest.raises(KeyError, match=r"9\.9"):
        caption("9.9", TABLE)
