"""What the pictures say of a machine whose answers are known."""

from __future__ import annotations

from typing import Any

from matplotlib.colors import to_hex

from macromicro.batch.programme_metrics import NAMES
from macromicro.drawing.style import BLUE, ORANGE
from macromicro.robustness import _figures
from macromicro.robustness.study import Study


def test_the_tornado_s_legend_names_what_its_bars_are(done: Study) -> None:
    """Colours as drawn: kinetic friction's low end makes the macro-stage quicker, its high end
    stops it, which is hatched."""
    figure: Any = next(d.figure for d in _figures.draw(done) if d.name == "tornado")
    (legend,) = figure.legends
    patches = legend.get_patches()
    labels = [text.get_text() for text in legend.get_texts()]
    named = dict(zip(labels, patches, strict=False))
    assert labels == ["at the low end", "at the high end", "never settled, or stopped", "nominal"]
    low, high = figure.axes[0].patches[:2]
    assert low.get_x() + low.get_width() < done.nominal[NAMES.index("macro_settling")]
    assert to_hex(low.get_facecolor()) == to_hex(named["at the low end"].get_facecolor())
    assert to_hex(high.get_edgecolor()) == to_hex(named["at the high end"].get_facecolor())
    assert high.get_hatch() == named["never settled, or stopped"].get_hatch()
    colours = [to_hex(p.get_facecolor()).upper() for p in patches[:2]]
    assert colours == [BLUE, ORANGE]
    assert not low.get_hatch()
