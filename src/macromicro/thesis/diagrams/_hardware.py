"""Block diagrams of what is wired to what (Chapter 3, Appendix D), and of the Preisach model."""

from __future__ import annotations

from macromicro.drawing.diagram import Diagram, block
from macromicro.plant.amplifier import Amplifier
from macromicro.plant.driver import Driver
from macromicro.thesis.diagrams._described import Described, number

_BOARD = Amplifier()
_PWM = block("PWM amplifier", f"{number(_BOARD.supply)} V")


def _duty(share: float) -> str:
    return f"0 to {number(100.0 * share)} % duty"


HARDWARE: dict[str, Described] = {
    "2.11": Described(
        Diagram(
            "Preisach model as a sum of relays",
            """
            .   A U .
            u_1 B V (s) f_1
            .   C W .
            """,
            {
                "A": block("relay 1", icon="hysteresis"),
                "B": block("relay 2", icon="hysteresis"),
                "C": block("relay n", icon="hysteresis"),
                "U": block("μ_1"),
                "V": block("μ_2"),
                "W": block("μ_n"),
            },
            "u_1 > A; u_1 > B; u_1 > C; A > U; B > V; C > W; U > s; V > s; W > s; s > f_1",
        ),
        "Relays in parallel, each with thresholds of its own, on one input; their outputs are "
        "weighted and summed (2.2).",
    ),
    "3.1": Described(
        Diagram(
            "Electrical operation of the carriage's motor",
            "B P M x",
            {
                "B": block("D/A", f"0 to {number(_BOARD.full_scale)} V"),
                "P": block(*_PWM.lines, _duty(_BOARD.motor_duty)),
                "M": block("motor,", "carriage"),
            },
            "B > P >[PWM] M > x",
        ),
        "The board's analogue output sets the duty cycle of the amplifier that drives the motor. "
        "The sign of the output is the direction.",
    ),
    "3.5": Described(
        Diagram(
            "Electrical operation of the actuator",
            """
            B P N x
            . . S .
            """,
            {
                "B": block("D/A", f"0 to {number(_BOARD.full_scale)} V"),
                "P": block(*_PWM.lines, _duty(_BOARD.ctrl_duty)),
                "N": block("actuator"),
                "S": block("supply", f"{number(Driver().supply)} V"),
            },
            "B > P >[CTRL] N > x; S >[VDC] N",
        ),
        "CTRL is a PWM signal: it sets how much of the supply's current to let through the wires.",
    ),
    "D.2": Described(
        Diagram(
            "The whole system",
            """
            r C B P G x_1
            . .   . <E . .
            . .   . N M x_2
            . .   . <H . .
            """,
            {
                "C": block("controllers"),
                "B": block("D/A, A/D,", "counter"),
                "P": block(*_PWM.lines),
                "G": block("macro-", "stage"),
                "E": block("encoder"),
                "N": block("actuator"),
                "M": block("guide,", "platform"),
                "H": block("Hall sensor"),
            },
            "r > C > B > P > G > x_1; G > E > C; B >[CTRL] N > M > x_2; M > H > C",
        ),
        "One board serves both stages: analogue outputs for motor and actuator, a counter for "
        "the encoder, an analogue input for the Hall sensor.",
    ),
}
