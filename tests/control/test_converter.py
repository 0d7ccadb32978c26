"""The D/A converter of Section 3.3."""

from __future__ import annotations

import pytest

from macromicro.control.converter import rounded


def test_to_the_nearest_step() -> None:
    assert rounded(1.2345, 0.0) == 1.2345
    assert rounded(1.2345, 0.01) == pytest.approx(1.23)
    assert rounded(1.2351, 0.01) == pytest.approx(1.24)
    assert rounded(-1.2351, 0.01) == pytest.approx(-1.24)
