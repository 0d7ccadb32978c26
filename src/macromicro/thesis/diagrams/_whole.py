"""Block diagram of the whole positioner (Section 6.1)."""

from __future__ import annotations

from macromicro.control.arrival import Sequence
from macromicro.drawing.diagram import Diagram, block, quantiser, saturation
from macromicro.models.macro import MacroModel
from macromicro.thesis.diagrams._described import Described, number

_WAIT = f"wait {number(Sequence().wait)} s"
_MODEL = MacroModel()

WHOLE: dict[str, Described] = {
    "6.1": Described(
        Diagram(
            "Control of macro- and micro-stage together",
            """
            .    .  .   .  .  <Q .
            r_1 (e) D   N  S  G  y_1
            .    .  .   A  .  .  .
            r_2 (f) C   W  M  L  y_2
            .    .  .   . <H  .  .
            """,
            {
                "D": block("PD"),
                "N": block(f"±{number(_MODEL.width)} V", icon="inverse"),
                "S": saturation(f"±{number(_MODEL.limit)} V"),
                "G": block("macro-", "stage"),
                "Q": quantiser("encoder"),
                "A": block("arrived?", _WAIT),
                "C": block("PI, anti-", "windup"),
                "W": block("else 0 V", icon="switch"),
                "M": block("micro-", "stage"),
                "L": block("laser"),
                "H": block("Hall sensor,", "calibration"),
            },
            "r_1 > e > D > N > S > G > y_1; G > Q >- e; e > A; A ~>[enable] W; A ~>[reset] L; "
            "r_2 > f > C > W >[CTRL] M > L > y_2; M > H >- f",
        ),
        "The macro-stage goes to its target first. On arrival its motor is switched off; after "
        "the wait for its vibration the laser is set to zero and the micro-stage enabled. The "
        "laser only verifies. The next macro move disables the micro-stage again.",
    ),
}
