"""Block diagrams of the micro-stage (Chapter 5); gains and limits from the laws' defaults."""

from __future__ import annotations

from macromicro.control.pi import Pi, PiAntiWindup
from macromicro.drawing.diagram import Diagram, block, framed, saturation
from macromicro.thesis.diagrams._described import Described, number

_PI, _ANTI = Pi(), PiAntiWindup()
_STAGE = block("micro-", "stage")
_HALL = block("Hall sensor,", "calibration")
_INTEGRATOR = block("T//z - 1")


def _gain(symbol: str, value: float) -> str:
    return f"{symbol} = {number(value)}"


def _limits(p: Pi | PiAntiWindup) -> tuple[str, str]:
    return f"{number(p.low)} to", f"{number(p.high)} V"


MICRO: dict[str, Described] = {
    "5.1": Described(
        Diagram(
            "Actuator model",
            "CTRL D H P x",
            {
                "D": block("driver", "circuit"),
                "H": block("thermal", "dynamics"),
                "P": block("hysteresis", icon="hysteresis"),
            },
            "CTRL > D >[i] H >[T] P > x",
        ),
        "CTRL sets the current through a driver that is not known; the current heats the wires; "
        "their temperature sets the contraction, with hysteresis.",
    ),
    "5.2": Described(
        Diagram(
            "Simplified actuator model",
            "CTRL M P x",
            {
                "M": block("electro-thermal", "model"),
                "P": block("hysteresis", icon="hysteresis"),
            },
            "CTRL > M >[T] P > x",
        ),
        "Driver and heat as one model, taken to be linear: hysteresis is the only nonlinearity.",
    ),
    "5.12": Described(
        Diagram(
            "Actuator model with a nonlinear gain",
            "CTRL G H P x",
            {
                "G": block("φ", "(5.5), (5.8)"),
                "H": block("Θ", "(5.6), (5.9)"),
                "P": block("(5.1)", icon="hysteresis"),
            },
            "CTRL > G >[T_d] H >[T] P > x",
            (framed("electro-thermal model", "G H"),),
        ),
        "A static gain φ gives the temperature that CTRL leads to; linear dynamics Θ lead "
        "there, of third order in heating and of first order in cooling.",
    ),
    "5.18": Described(
        Diagram(
            "Closed loop of the micro-stage",
            """
            r (e) D G x
            . . . <H .
            """,
            {"D": block("D(z)"), "G": _STAGE, "H": _HALL},
            "r > e > D >[CTRL] G > x; G > H >- e",
        ),
        "The Hall sensor's voltage, by its calibration, is the measured contraction.",
    ),
    "5.21": Described(
        Diagram(
            "PI control of the micro-stage",
            """
            r (e) P  . (u) S G x
            .  .  K  I  .  . . .
            .  .  .  .  .  . <H .
            """,
            {
                "P": block(_gain("K_p", 1e-3 * _PI.kp)),
                "K": block(_gain("K_i", 1e-3 * _PI.ki)),
                "I": _INTEGRATOR,
                "S": saturation(*_limits(_PI)),
                "G": _STAGE,
                "H": _HALL,
            },
            "r > e > P > u > S >[CTRL] G > x; e > K > I > u; G > H >- e",
        ),
        "Gains in V/mm and V/(mm s); the integrator sums over periods of T. It continues "
        "while the output is saturated: it winds up.",
    ),
    "5.24": Described(
        Diagram(
            "PI control of the micro-stage with anti-windup",
            """
            r (e) P  . .  (u) S   . G x
            .  .  K (w) I  .  .   . . .
            .  .  .  . <A  . <(d) . . .
            .  .  .  .  .  .  .   . <H .
            """,
            {
                "P": block(_gain("K_p", 1e-3 * _ANTI.kp)),
                "K": block(_gain("K_i", 1e-3 * _ANTI.ki)),
                "I": _INTEGRATOR,
                "A": block(_gain("K_{aw}", _ANTI.kaw)),
                "S": saturation(*_limits(_ANTI)),
                "G": _STAGE,
                "H": _HALL,
            },
            "r > e > P > u > S >[CTRL] G > x; e > K > w > I > u; S >+ d; u >- d; d > A > w; "
            "G > H >- e",
        ),
        "What the saturation cuts off goes back to the integrator. Gains in V/mm, V/(mm s) "
        "and 1/s; below the lower limit the actuator does not respond.",
    ),
}
