"""The thesis' block diagrams and flow charts, drawn anew from what the code does."""

from __future__ import annotations

from macromicro.drawing import diagram, flow
from macromicro.drawing.diagram import Diagram
from macromicro.drawing.exhibit import Drawn
from macromicro.thesis.diagrams.charts import CHARTS
from macromicro.thesis.diagrams.described import Described
from macromicro.thesis.diagrams.hardware import HARDWARE
from macromicro.thesis.diagrams.macro import MACRO
from macromicro.thesis.diagrams.micro import MICRO
from macromicro.thesis.diagrams.whole import WHOLE

DIAGRAMS: dict[str, Described] = HARDWARE | MACRO | MICRO | WHOLE | CHARTS


def drawn(number: str) -> Drawn:
    """The diagram with the thesis' number, such as "4.3". Raises KeyError for others."""
    body, caption = DIAGRAMS[number]
    text = diagram.svg(body) if isinstance(body, Diagram) else flow.svg(body)
    return Drawn(number, body.title, caption, text)
