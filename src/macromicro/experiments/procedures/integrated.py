"""The integrated test (Chapter 6): both stages in turn, and ten cycles of it. Figures 6.2 to
6.5, claims I1 to I4 and I6."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.experiments import integrated
from macromicro.experiments.integrated import IntegratedRuns
from macromicro.experiments.procedure import Lab, Procedure
from macromicro.experiments.procedures import _integrated_figures as figures
from macromicro.experiments.procedures._integrated_cycling import cycling


def collect(lab: Lab) -> IntegratedRuns:
    """Ten cycles without a fan, ten with one, and squares."""
    return integrated.collect(lab.settings, lab.seed, lab.runner())


def draw(runs: IntegratedRuns) -> Iterator[Drawn]:
    """Figures 6.2 to 6.5 and the squares."""
    yield figures.response(runs)
    yield figures.vibration(runs)
    yield cycling("6.4", runs, runs.warm, "I3")
    yield cycling("6.5", runs, runs.cooled, "I4")
    yield figures.squares(runs)


PROCEDURE = Procedure(
    name="integrated",
    title="The integrated system",
    sections=("6.1", "6.2", "6.3", "6.3.1", "6.4.2"),
    channels=("encoder", "hall", "laser"),
    ids=("I1", "I2", "I3", "I4", "I6"),
    figures=("6.2", "6.3", "6.4", "6.5", "6.5 (squares)"),
    diagrams=("6.1",),
    seconds=3.0,
    collect=collect,
    claims=integrated.claims,
    draw=draw,
)
