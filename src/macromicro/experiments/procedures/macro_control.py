"""The macro-stage's three controllers (Sections 4.3, 6.4.2): Figures 4.18 to 4.25, claims M9
to M16."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.experiments import macro_control, macro_design
from macromicro.experiments.macro_control import MacroData
from macromicro.experiments.procedure import Lab, Procedure
from macromicro.experiments.procedures import _macro_responses, _macro_tuning


def collect(lab: Lab) -> MacroData:
    """Steps, decaying squares and a full-travel move, the design and its simulations."""
    return macro_control.collect(lab.bench(), lab.settings, lab.seed, lab.runner())


def draw(data: MacroData) -> Iterator[Drawn]:
    """Figures 4.18, 4.20, 4.22 to 4.25."""
    yield _macro_responses.pid(data)
    yield _macro_responses.initial_pd(data)
    yield _macro_tuning.ratios(data.design)
    yield _macro_tuning.frequencies(data.design)
    yield _macro_responses.tuned_pd(data)
    yield _macro_responses.comparison(data)


PROCEDURE = Procedure(
    name="macro-control",
    title="Controllers of the macro-stage",
    sections=("4.3.1", "4.3.2", "4.3.3", "4.3.4", "6.4.2"),
    channels=("encoder", "laser"),
    ids=("M9", "M10", "M11", "M11b", "M12", "M13", "M14", "M15", "M16"),
    figures=("4.18", "4.20", "4.22", "4.23", "4.24", "4.25"),
    diagrams=("4.19", "4.21"),
    seconds=2.5,
    collect=collect,
    claims=macro_control.claims,
    draw=draw,
    arithmetic=macro_design.margins,
)
