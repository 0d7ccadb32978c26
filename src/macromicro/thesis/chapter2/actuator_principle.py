"""Principle of the actuator (Section 2.3) and calorimetry (Appendix A)."""

from __future__ import annotations

from macromicro.thesis.chapter2 import _actuator_figures, _actuator_runs
from macromicro.thesis.chapter2._actuator_runs import Principle
from macromicro.thesis.claims import Claim, measured_by
from macromicro.thesis.procedure import Lab, Procedure


def collect(lab: Lab) -> Principle:
    return _actuator_runs.collect(lab.settings.bench)


def claims(data: Principle) -> list[Claim]:
    return []


PROCEDURE = Procedure(
    name="actuator-principle",
    title="Principle of the shape-memory actuator",
    sections=("2.3", "Appendix A"),
    channels=(),
    ids=measured_by("actuator-principle"),
    figures={
        "2.8": _actuator_figures.hysteresis,
        "2.9": _actuator_figures.stress_strain,
        "2.10": _actuator_figures.work,
        "(2.1)": _actuator_figures.heat,
        "A.1": _actuator_figures.calorimeter,
    },
    diagrams=(),
    seconds=2.0,
    collect=collect,
    claims=claims,
)
