"""The micro-stage alone (Sections 5.2.2 and 5.3): where it begins and stops, and P, PI and
anti-windup control. Figures 5.19 to 5.27, claims S3, S4 and S11 to S13c."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.thesis.chapter5 import gain_figures, micro_claims, micro_runs, sequence_figures
from macromicro.thesis.chapter5.micro_runs import MicroRuns
from macromicro.thesis.claims import measured_by
from macromicro.thesis.procedure import Lab, Procedure


def collect(lab: Lab) -> MicroRuns:
    """Steps in open loop, steps to 3.8 mm with every gain, sequences and holds."""
    return micro_runs.collect(lab.settings, lab.seed, lab.runner(), lab.bench())


def draw(runs: MicroRuns) -> Iterator[Drawn]:
    """Where the stage begins and stops, then Figures 5.19 to 5.27."""
    yield gain_figures.stop(runs)
    yield gain_figures.effort(runs)
    yield gain_figures.proportional(runs)
    yield gain_figures.integral(runs)
    yield sequence_figures.windup(runs)
    yield sequence_figures.anti_windup(runs)
    yield gain_figures.held_back(runs)
    yield sequence_figures.final(runs)


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
    claims=micro_claims.claims,
    draw=draw,
)
