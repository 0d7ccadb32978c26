"""The micro-stage alone (Sections 5.2.2 and 5.3): Figures 5.19 to 5.27, S3, S4, S11 to S13c."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.thesis.chapter5 import _gain_figures, _micro_claims, _sequence_figures, micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns
from macromicro.thesis.claims import measured_by
from macromicro.thesis.procedure import Lab, Procedure


def collect(lab: Lab) -> MicroRuns:
    return micro_runs.collect(lab.settings, lab.seed, lab.runner(), lab.bench())


def draw(runs: MicroRuns) -> Iterator[Drawn]:
    yield _gain_figures.stop(runs)
    yield _gain_figures.effort(runs)
    yield _gain_figures.proportional(runs)
    yield _gain_figures.integral(runs)
    yield _sequence_figures.windup(runs)
    yield _sequence_figures.anti_windup(runs)
    yield _gain_figures.held_back(runs)
    yield _sequence_figures.final(runs)


PROCEDURE = Procedure(
    name="micro-control",
    title="Control of the micro-stage",
    sections=("5.2.2", "5.3.1", "5.3.2"),
    channels=("hall", "laser"),
    ids=measured_by("micro-control"),
    figures=("5.10 (stop)", "5.19", "5.20", "5.22", "5.23", "5.25", "5.26", "5.27"),
    diagrams=("5.18", "5.21", "5.24"),
    seconds=7.0,
    collect=collect,
    claims=_micro_claims.claims,
    draw=draw,
)
