"""Open-loop steps and the actuator models (Sections 5.2.2 and 5.2.3)."""

from __future__ import annotations

from macromicro.identify.kiln import fod_table
from macromicro.thesis.chapter5 import actuator_models, electrothermal_claims, kiln_runs
from macromicro.thesis.chapter5._electrothermal_figures import FIGURES
from macromicro.thesis.chapter5.actuator_models import Models, Unfitted
from macromicro.thesis.claims import measured_by
from macromicro.thesis.procedure import Lab, Procedure


def collect(lab: Lab) -> Models | Unfitted:
    curves = kiln_runs.run(lab.kiln(), kiln_runs.cycles(), lab.seed)
    return actuator_models.attempted(fod_table([curves]), lab.bench(), lab.seed)


PROCEDURE = Procedure(
    name="electrothermal",
    title="Electro-thermal model and full actuator model",
    sections=("5.1", "5.2.2", "5.2.3"),
    channels=("kiln.thermocouple", "kiln.encoder", "laser", "contract"),
    ids=measured_by("electrothermal"),
    figures=FIGURES,
    diagrams=("5.1", "5.2", "5.12"),
    seconds=8.0,
    collect=collect,
    claims=electrothermal_claims.claims,
    arithmetic=electrothermal_claims.printed_gain,
)
