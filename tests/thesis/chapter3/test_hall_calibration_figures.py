"""Figure 3.9."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.thesis.contents import find
from macromicro.thesis.procedure import Lab

PROCEDURE = find("hall-calibration")


@pytest.mark.slow
def test_figure_shows_every_run_and_the_table() -> None:
    data = PROCEDURE.collect(Lab())
    drawn = PROCEDURE.figures["3.9"](data)
    whole, near = drawn.body.axes
    labels = [line.get_label() for line in whole.lines]
    assert {"runs up", "runs down", "averaged"} <= set(labels)
    for (hall, laser), line in zip(data.runs, whole.lines, strict=False):
        x, y = line.get_data()
        np.testing.assert_allclose((x.min(), x.max()), (hall.min(), hall.max()), atol=0.01)
        assert (y.min(), y.max()) == (1e3 * laser.min(), 1e3 * laser.max())
    seen = np.isfinite(data.fit.std)
    x, y = whole.lines[labels.index("averaged")].get_data()
    np.testing.assert_array_equal(x, data.fit.volts[seen])
    np.testing.assert_array_equal(y, 1e3 * data.fit.calibration.position[seen])
    ups = [r for r, (_, laser) in enumerate(data.runs) if laser[-1] > laser[0]]
    for r, line in enumerate(near.lines[:-1]):
        inner = line.get_ydata()[20:-20]
        assert (np.median(inner) > 0.0) == (r in ups)
    assert f"{data.slopes.mean:.2f} um/mV over the travel" in drawn.caption
