"""Colours of families of curves."""

from __future__ import annotations

import pytest

from macromicro.drawing.style import shades


@pytest.mark.parametrize("count", [1, 5, 28])
def test_shades_differ_and_rise_in_brightness(count: int) -> None:
    colours = shades(count)
    assert len(set(colours)) == count
    weights = (0.2126, 0.7152, 0.0722)
    bright = [
        sum(w * int(c[1 + 2 * k : 3 + 2 * k], 16) for k, w in enumerate(weights)) for c in colours
    ]
    assert bright == sorted(bright)
    assert max(bright) < 220.0, "a colour that white paper swallows"
