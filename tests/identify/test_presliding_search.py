"""Pieces of a record with elastic friction begin where the axis slides."""

from __future__ import annotations

import numpy as np
import pytest
from tests.identify.elastic import DT, STAGE

from macromicro.identify._axis_pieces import settled
from macromicro.identify._presliding_search import pieces_of
from macromicro.identify.axis_inverse import Rows, differences
from macromicro.identify.presliding import simulate
from macromicro.identify.runs import Run


def strokes(wiggles: slice, n: int = 8000, noise: float = 0.0) -> Rows:
    """Strokes, and wiggles that the friction holds."""
    t = np.arange(n) * DT
    u = 11.0 * np.sin(1.4 * np.pi * t)
    u[wiggles] = 3.5 * np.sin(6.2 * np.pi * t[wiggles])
    x = simulate(STAGE, u, DT) + noise * np.random.default_rng(0).standard_normal(n)
    return differences(Run(t, u, x), u, 80.0, 5)


@pytest.mark.parametrize("first", [1000, 1300, 1800, 2000])
def test_no_piece_begins_amid_wiggles(first: int) -> None:
    """Cuts at 2667 and 5333: the first one among wiggles of three seconds."""
    rows = strokes(slice(first, first + 3000))
    (made,) = pieces_of([rows], 2667)
    assert made.starts[0] == 0 and len(made.starts) == 3
    assert made.lengths.sum() == 8000 and made.lengths.min() > 800
    for at in made.starts[1:].tolist():
        assert not first + 200 <= at < first + 3000  # it slides on for a while
        assert abs(rows.v[at]) >= 0.1 * np.abs(rows.v).max()
        way = rows.run.x[at - 60 : at + 1]
        assert np.ptp(way) > 2e-3 and (np.diff(way) * rows.v[at] > 0.0).mean() > 0.5


def test_a_piece_goes_on_where_nothing_slides_before_the_next_cut() -> None:
    (made,) = pieces_of([strokes(slice(1200, 7000))], 1000)
    inside = made.starts[(made.starts >= 1200) & (made.starts < 7000)]
    assert not len(inside) and 2 <= len(made.starts) <= 4
    (plain,) = pieces_of([strokes(slice(0, 0))], 1000)
    assert len(plain.starts) == 8


def test_a_record_that_slides_at_its_begin_alone_is_cut_all_the_same() -> None:
    """Pieces that are held out have to be others than those that are fitted."""
    (made,) = pieces_of([strokes(slice(60, 8000))], 1000)
    assert len(made.starts) == 8 and (np.diff(made.starts) > 0).all()


@pytest.mark.parametrize("first", [1300, 2000])
def test_the_true_axis_misses_no_more_than_noise_of_the_position(first: int) -> None:
    """From a start among wiggles it missed by forty times as much."""
    (made,) = pieces_of([strokes(slice(first, first + 3000), noise=1e-7)], 2667, free=True)
    assert np.sqrt(np.mean(settled(made, STAGE).error ** 2)) < 2e-7
