"""The thesis' block diagrams and flow charts, redrawn from the code."""

from __future__ import annotations

from macromicro.drawing import diagram, flow
from macromicro.drawing.diagram import Diagram
from macromicro.drawing.exhibit import Drawn
from macromicro.thesis.diagrams._charts import CHARTS
from macromicro.thesis.diagrams._described import Described
from macromicro.thesis.diagrams._hardware import HARDWARE
from macromicro.thesis.diagrams._macro import MACRO
from macromicro.thesis.diagrams._micro import MICRO
from macromicro.thesis.diagrams._whole import WHOLE

DIAGRAMS: dict[str, Described] = HARDWARE | MACRO | MICRO | WHOLE | CHARTS


def drawn(number: str) -> Drawn:
    """The diagram with the thesis' number, such as "4.3"; KeyError for others."""
    body, caption = DIAGRAMS[number]
    text = diagram.svg(body) if isinstance(body, Diagram) else flow.svg(body)
    return Drawn(number, body.title, caption, text)
