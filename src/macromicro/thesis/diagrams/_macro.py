"""Block diagrams of the macro-stage (Chapter 4); numbers from the models' and laws' defaults."""

from __future__ import annotations

from macromicro.control.pd import PdInitial, PdTuned
from macromicro.drawing.diagram import Diagram, block, dead_zone, framed, saturation
from macromicro.models.macro import MacroModel, position_transfer
from macromicro.thesis.diagrams._described import Described, number

_MODEL = MacroModel()
_NUM, _DEN = position_transfer(_MODEL.linear)
_LIMIT, _WIDTH = f"±{number(_MODEL.limit)} V", f"±{number(_MODEL.width)} V"

_SATURATION = saturation(_LIMIT)
_ZONE = dead_zone(_WIDTH)
_INVERSE = block(_WIDTH, icon="inverse")
_JUMP = block(
    _WIDTH, f"a_0 = {number(_MODEL.a0)} V", f"δ = {number(_MODEL.delta)}", icon="jump zone"
)
_FIRST_ORDER = block("b//z + a")
_INTEGRATOR = block("T//z - 1")
_POSITION = block(
    f"{number(_NUM[-1])}//z^2 - {number(-_DEN[1])} z + {number(_DEN[2])}",
)


def _pd(law: PdInitial | PdTuned) -> str:
    sign = "-" if law.before < 0.0 else "+"
    return f"{_decimal(law.now)} z {sign} {_decimal(abs(law.before))}//z"


def _decimal(value: float) -> str:
    return f"{value:.12f}".rstrip("0")


MACRO: dict[str, Described] = {
    "4.3": Described(
        Diagram(
            "Block diagram of the macro-stage motor",
            """
            .      .   .    .    .  .   .  <F    .  .
            V_{in} S   K_a (e)   L  K_t (t) J    K  y
            .      .   .    .    .  .   .  <B    .  .
            .      .   .    .    .  <K_b .  .    .  .
            """,
            {
                "S": _SATURATION,
                "K_a": block("K_a"),
                "L": block("1//L s + R"),
                "K_t": block("K_t"),
                "F": block("F", icon="sign"),
                "J": block("1//J s"),
                "B": block("B"),
                "K": block("K_{lin}//s"),
                "K_b": block("K_b"),
            },
            "V_{in} > S > K_a > e > L > K_t > t > J >[ω] K > y; "
            "J > F >- t; J > B >- t; J > K_b >- e",
        ),
        "Equation (4.1), its back-EMF with the sign that a motor has: the D/A board limits "
        "the voltage, the current drives the shaft against viscous damping B and Coulomb "
        "friction F.",
    ),
    "4.5": Described(
        Diagram(
            "Motor with the Coulomb friction moved to the input",
            """
            .      .  .   <R   .  .   .  <F  .  .
            V_{in} S (f)  K_a (e) M   (t) J  K  y
            .      .  .   .    .  .   .  <B  .  .
            .      .  .   .    .  <K_b .  .  .  .
            """,
            {
                "S": _SATURATION,
                "R": block("R//K_a K_t"),
                "F": block("F", icon="sign"),
                "K_a": block("K_a"),
                "M": block("K_t//R"),
                "J": block("1//J s"),
                "B": block("B"),
                "K": block("K_{lin}//s"),
                "K_b": block("K_b"),
            },
            "V_{in} > S > f >[V'] K_a > e > M > t > J >[ω] K > y; "
            "J > F > R >- f; J > B >- t; J > K_b >- e",
        ),
        "With the inductance neglected, a torque F at the shaft is worth a voltage at "
        "the input, by the factor in its path; what lies behind V' is a linear motor.",
    ),
    "4.6": Described(
        Diagram(
            "First-order model of the motor with Coulomb friction",
            """
            V_{in} S (f) . G I y
            .      . .  <R <F . .
            """,
            {
                "S": _SATURATION,
                "G": _FIRST_ORDER,
                "I": _INTEGRATOR,
                "R": block("R//K_a K_t"),
                "F": block("F", icon="sign"),
            },
            "V_{in} > S > f >[V'] G >[ẏ] I > y; G > F > R >- f",
        ),
        "The linear motor as (4.3), sampled with period T. From rest V' differs from zero only "
        "where the input is worth more than the friction.",
    ),
    "4.7": Described(
        Diagram(
            "First-order model of the motor with a dead zone for the friction",
            "V_{in} S D G I y",
            {"S": _SATURATION, "D": _ZONE, "G": _FIRST_ORDER, "I": _INTEGRATOR},
            "V_{in} > S > D >[V'] G >[ẏ] I > y",
        ),
        "Friction as a dead zone at the input: no net voltage V' until the input exceeds the "
        "threshold.",
    ),
    "4.10": Described(
        Diagram(
            "Open-loop system with the initial friction model",
            "V N S D G I y",
            {
                "N": _INVERSE,
                "S": _SATURATION,
                "D": _ZONE,
                "G": _FIRST_ORDER,
                "I": _INTEGRATOR,
            },
            "V > N >[V_{in}] S > D >[V'] G >[ẏ] I > y",
            (framed("software", "N"), framed("plant model", "S D G I")),
        ),
        "The inverse lifts the input by the dead zone's width, so that from V to speed the "
        "system looks linear as long as nothing saturates.",
    ),
    "4.12": Described(
        Diagram(
            "Initial nonlinear simulation model",
            "V N S D G y",
            {"N": _INVERSE, "S": _SATURATION, "D": _ZONE, "G": _POSITION},
            "V > N > S > D > G > y",
        ),
        "Inverse, saturation, dead zone and (4.4): volts in, counts out.",
    ),
    "4.15": Described(
        Diagram(
            "Open-loop system with the tuned friction model",
            "V N S D G I y",
            {
                "N": _INVERSE,
                "S": _SATURATION,
                "D": _JUMP,
                "G": _FIRST_ORDER,
                "I": _INTEGRATOR,
            },
            "V > N >[V_{in}] S > D >[V'] G >[ẏ] I > y",
            (framed("software", "N"), framed("plant model", "S D G I")),
        ),
        "As Figure 4.10, the dead zone with a jump in place of the simple one: beyond the "
        "threshold the rest V gives V' = (a0 + δ |V|) sgn V, (4.5).",
    ),
    "4.16": Described(
        Diagram(
            "Tuned nonlinear simulation model",
            "V N S D G y",
            {"N": _INVERSE, "S": _SATURATION, "D": _JUMP, "G": _POSITION},
            "V > N > S > D > G > y",
        ),
        "As Figure 4.12, with the jump of (4.5) in the dead zone.",
    ),
    "4.19": Described(
        Diagram(
            "Linear closed loop of the macro-stage",
            "r (e) D G y",
            {"D": block(_pd(PdInitial())), "G": _POSITION},
            "r > e > D >[V] G > y; G >- e",
        ),
        "The controller (4.9) on the model (4.4). Dead zone and inverse cancel and are left out, "
        "the limit of the D/A board with them.",
    ),
    "4.21": Described(
        Diagram(
            "Tuned nonlinear closed loop of the macro-stage",
            """
            r (e) D N S
            . <y <G <Z .
            """,
            {
                "D": block(_pd(PdTuned())),
                "N": _INVERSE,
                "S": _SATURATION,
                "Z": _JUMP,
                "G": _POSITION,
            },
            "r > e > D >[V] N > S > Z > G > y; G >- e",
        ),
        "The controller (4.10), with the minus sign that gives its stated crossover, the "
        "inverse of the dead zone, and the tuned model of Figure 4.16.",
    ),
}
