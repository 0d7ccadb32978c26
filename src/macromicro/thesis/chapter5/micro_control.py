"""The micro-stage alone (Sections 5.2.2 and 5.3): Figures 5.19 to 5.27, S3, S4, S11 to S13c."""

from __future__ import annotations

from macromicro.thesis.chapter5 import _gain_figures, _micro_claims, _sequence_figures, micro_runs
from macromicro.thesis.chapter5.micro_runs import MicroRuns
from macromicro.thesis.claims import measured_by
from macromicro.thesis.procedure import Lab, Procedure


def collect(lab: Lab) -> MicroRuns:
    return micro_runs.collect(lab.settings, lab.seed, lab.runner(), lab.bench())


PROCEDURE = Procedure(
    name="micro-control",
    title="Control of the micro-stage",
    sections=("5.2.2", "5.3.1", "5.3.2"),
    channels=("hall", "laser"),
    ids=measured_by("micro-control"),
    figures={
        "5.10 (stop)": _gain_figures.stop,
        "5.19": _gain_figures.effort,
        "5.20": _gain_figures.proportional,
        "5.22": _gain_figures.integral,
        "5.23": _sequence_figures.windup,
        "5.25": _sequence_figures.anti_windup,
        "5.26": _gain_figures.held_back,
        "5.27": _sequence_figures.final,
    },
    diagrams=("5.18", "5.21", "5.24"),
    seconds=7.0,
    collect=collect,
    claims=_micro_claims.claims,
)
