"""The thesis' block diagrams and flow charts: SVG files whose numbers come from the code."""

from __future__ import annotations

import inspect
import tomllib
from pathlib import Path
from typing import NamedTuple

from macromicro.control.arrival import Sequence
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pi import Pi, PiAntiWindup
from macromicro.drawing.exhibit import Drawn
from macromicro.identify.kiln import without_spikes
from macromicro.identify.linear import MAX_ITERATIONS
from macromicro.models.macro import MacroModel, position_transfer
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.driver import Driver

_FOLDER = Path(__file__).parent
# Title and caption of each diagram, by the thesis' number.
DIAGRAMS: dict[str, dict[str, str]] = tomllib.loads(
    (_FOLDER / "diagrams.toml").read_text(encoding="utf-8")
)


class Parameters(NamedTuple):
    """Parameters whose values stand in the diagrams."""

    board: Amplifier = Amplifier()
    driver: Driver = Driver()
    model: MacroModel = MacroModel()
    initial: PdInitial = PdInitial()
    tuned: PdTuned = PdTuned()
    pi: Pi = Pi()
    anti_windup: PiAntiWindup = PiAntiWindup()
    sequence: Sequence = Sequence()


PARAMETERS = Parameters()


def draw(number: str, parameters: Parameters = PARAMETERS) -> Drawn:
    """The diagram with the thesis' number, such as "4.3"; KeyError for others."""
    title, caption = DIAGRAMS[number]["title"], DIAGRAMS[number]["caption"]
    template = (_FOLDER / f"{number}.svg").read_text(encoding="utf-8")
    return Drawn(title, caption, template.format(title=title, **_values(parameters)))


def _values(p: Parameters) -> dict[str, object]:
    """The values by the names in the SVG files' braces."""
    (gain,), (_, a1, a2) = position_transfer(p.model.linear)
    return p._asdict() | {
        "initial": _taps(p.initial),
        "tuned": _taps(p.tuned),
        "pi": _per_mm(p.pi),
        "anti_windup": _per_mm(p.anti_windup),
        "motor_duty": 100.0 * p.board.motor_duty,  # %
        "ctrl_duty": 100.0 * p.board.ctrl_duty,  # %
        # (4.4): gain / (z^2 - pole_sum z + pole_product)
        "gain": gain,
        "pole_sum": -a1,
        "pole_product": a2,
        "iterations": MAX_ITERATIONS,
        "smoothing": {
            k: v.default for k, v in inspect.signature(without_spikes).parameters.items()
        },
    }


def _per_mm(law: Pi | PiAntiWindup) -> Pi | PiAntiWindup:
    """A law with its gains in V/mm and V/(mm s)."""
    return law._replace(kp=1e-3 * law.kp, ki=1e-3 * law.ki)


def _taps(law: PdInitial | PdTuned) -> str:
    """The numerator of a PD controller."""
    sign = "\N{MINUS SIGN}" if law.before < 0.0 else "+"
    return f"{_decimal(law.now)} z {sign} {_decimal(abs(law.before))}"


def _decimal(value: float) -> str:
    return f"{value:.12f}".rstrip("0")
