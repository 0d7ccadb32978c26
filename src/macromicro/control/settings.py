"""What a user may set about control, and its form for the kernels."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from macromicro.control import calibration, macro
from macromicro.control.arrival import Sequence
from macromicro.control.calibration import Calibration
from macromicro.control.macro import LAWS, MacroLaw
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pi import HIGHEST, Pi, PiAntiWindup, Proportional
from macromicro.control.pid import Pid
from macromicro.control.supervisor import Supervisor
from macromicro.nominal import FULL_SCALE
from macromicro.schema.par import Par, with_sets

MICRO_LAWS = ("p", "pi", "pi-antiwindup")
SWITCH = ("as designed", "on", "off")


@with_sets({law.field: law.gains() for law in LAWS}, before="p")
class Control(NamedTuple):
    """Choice of laws, their gains and the sequence of Figure 6.1."""

    macro_law: Annotated[
        str, Par("", "control law of the macro-stage", "Section 4.3", choices=macro.NAMES)
    ] = "pd-tuned"
    dead_zone_inverse: Annotated[
        str,
        Par(
            "", "compensation of friction by the dead-zone inverse", "Section 4.2.3", choices=SWITCH
        ),
    ] = "as designed"
    dead_zone: Annotated[
        float, Par("V", "width of the dead zone", "Section 4.2.3 (M1)", lo=0.0, hi=HIGHEST)
    ] = 3.0
    motor_limit: Annotated[
        float, Par("V", "largest effort of the macro law", "Section 3.1", lo=0.0, hi=HIGHEST)
    ] = FULL_SCALE
    ctrl_limit: Annotated[
        float, Par("V", "largest effort of the micro law", "Section 3.2.1", lo=0.0, hi=HIGHEST)
    ] = FULL_SCALE
    micro_law: Annotated[
        str, Par("", "control law of the micro-stage", "Section 5.3", choices=MICRO_LAWS)
    ] = "pi-antiwindup"
    pid: Pid = Pid()
    pd_initial: PdInitial = PdInitial()
    pd_tuned: PdTuned = PdTuned()
    p: Proportional = Proportional()
    pi: Pi = Pi()
    pi_antiwindup: PiAntiWindup = PiAntiWindup()
    sequence: Sequence = Sequence()

    def problems(self) -> list[tuple[str, Any, str]]:
        """What cannot work.

        Returns
        -------
        list[tuple[str, Any, str]]
            Parameter, value, and what is accepted.
        """
        laws = (("p", self.p), ("pi", self.pi), ("pi_antiwindup", self.pi_antiwindup))
        rules: list[tuple[bool, str, Any, str]] = [
            (self.dead_zone >= self.motor_limit, "dead_zone", self.dead_zone, "motor_limit"),
            *((law.low >= law.high, f"{name}.low", law.low, f"{name}.high") for name, law in laws),
        ]
        found = [
            (path, value, "below {" + bound + "}") for wrong, path, value, bound in rules if wrong
        ]
        found += [
            (f"{name}.high", law.high, "at most {ctrl_limit}")
            for name, law in laws
            if law.high > self.ctrl_limit
        ]
        return found


def prepare(spec: Control, fan: bool = False, table: Calibration | None = None) -> Supervisor:
    """The supervisor's runtime parameters.

    Parameters
    ----------
    spec : Control
        Laws, gains and sequence.
    fan : bool, optional
        Whether the fan cools the wires.
    table : Calibration | None, optional
        Hall calibration; None for the shipped one.

    Returns
    -------
    Supervisor
        For the kernels.
    """
    law = macro.NAMES.index(spec.macro_law)
    lifted = spec.dead_zone_inverse == "on" or (
        spec.dead_zone_inverse == "as designed" and LAWS[law].compensated
    )
    fine = getattr(spec, spec.micro_law.replace("-", "_"))
    return Supervisor(
        MacroLaw(
            law,
            spec.dead_zone if lifted else 0.0,
            spec.motor_limit,
            tuple(getattr(spec, each.field) for each in LAWS),
        ),
        PiAntiWindup(*fine),
        spec.sequence,
        calibration.shipped() if table is None else table,
        1.0 if fan else 0.0,
    )
