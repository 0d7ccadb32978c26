"""Heating in the kiln (Section 5.2.1): Figures 5.5 to 5.9 and D.5 to D.7, claims S1, S2, S6."""

from __future__ import annotations

from macromicro.experiments import kiln, kiln_claims
from macromicro.experiments.kiln_claims import KilnRuns
from macromicro.experiments.procedure import Lab, Procedure
from macromicro.experiments.procedures._kiln_figures import draw


def collect(lab: Lab) -> KilnRuns:
    """Heating cycles with falling maxima, new profiles, and the table from the former."""
    return kiln_claims.identified(kiln.collect(lab.kiln(), lab.seed))


PROCEDURE = Procedure(
    name="kiln",
    title="Hysteresis in the kiln",
    sections=("5.2.1", "Appendix D"),
    channels=("kiln.thermocouple", "kiln.encoder"),
    ids=("S1", "S2", "S6"),
    figures=("5.5", "5.6", "5.7", "5.8", "5.9", "D.5", "D.6", "D.7"),
    diagrams=("5.4",),
    seconds=5.0,
    collect=collect,
    claims=kiln_claims.claims,
    draw=draw,
)
