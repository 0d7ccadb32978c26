"""The micro-stage alone (Sections 5.2.2 and 5.3): where it begins and stops, and P, PI and
anti-windup control. Figures 5.19 to 5.27, claims S3, S4 and S11 to S13c."""

from __future__ import annotations

from collections.abc import Iterator

from macromicro.drawing.exhibit import Drawn
from macromicro.experiments import micro_control, micro_runs
from macromicro.experiments.micro_runs import MicroRuns
from macromicro.experiments.procedure import Lab, Procedure
from macromicro.experiments.procedures import _micro_gains as gains
from macromicro.experiments.procedures import _micro_sequences as sequences


def collect(lab: Lab) -> MicroRuns:
    """Steps in open loop, steps to 3.8 mm with every gain, sequences and holds."""
    return micro_runs.collect(lab.settings, lab.seed, lab.runner(), lab.bench())


def draw(runs: MicroRuns) -> Iterator[Drawn]:
    """Where the stage begins and stops, then Figures 5.19 to 5.27."""
    yield gains.stop(runs)
    yield gains.effort(runs)
    yield gains.proportional(runs)
    yield gains.integral(runs)
    yield sequences.windup(runs)
    yield sequences.anti_windup(runs)
    yield gains.held_back(runs)
    yield sequences.final(runs)


PROCEDURE = Procedure(
    name="micro-control",
    title="Control of the micro-stage",
    sections=("5.2.2", "5.3.1", "5.3.2"),
    channels=("hall", "laser"),
    ids=("S3", "S4", "S11", "S12", "S13a", "S13b", "S13c"),
    figures=("5.10 (stop)", "5.19", "5.20", "5.22", "5.23", "5.25", "5.26", "5.27"),
    diagrams=("5.18", "5.21", "5.24"),
    seconds=7.0,
    collect=collect,
    claims=micro_control.claims,
    draw=draw,
)
