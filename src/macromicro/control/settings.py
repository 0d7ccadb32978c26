"""Control settings, and their form for the kernels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, Self

from macromicro.control import calibration, macro, micro, micro_stability, outside, stability
from macromicro.control.arrival import Sequence
from macromicro.control.calibration import Calibration
from macromicro.control.law import Law
from macromicro.control.macro import LAWS, SHIPPED, MacroLaw
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pi import HIGHEST, Pi, PiAntiWindup, Proportional
from macromicro.control.pid import Pid
from macromicro.control.stage_law import StageLaw
from macromicro.control.supervisor import Supervisor
from macromicro.errors import InputError
from macromicro.nominal import FULL_SCALE, PITCH
from macromicro.schema.keys import nearest
from macromicro.schema.par import Par, with_sets
from macromicro.schema.text import printable

MICRO_LAWS = ("p", "pi", "pi-antiwindup")
# Key of a law, its gains by the contract, and the laws of this package that need none.
_OWN = (("macro_law", "own", macro.NAMES), ("micro_law", "fine", MICRO_LAWS))
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
    own: Any = outside.NoGains()  # of the law by the contract that `macro_law` names
    fine: Any = outside.NoGains()  # of the one that `micro_law` names
    sequence: Sequence = Sequence()

    def also(self) -> dict[str, tuple[str, ...]]:
        """Further words that parameters accept."""
        found = {key: outside.of(getattr(self, gains)) for key, gains, _ in _OWN}
        return {key: (name,) for key, name in found.items() if name}

    def grown(self, table: Mapping[str, object], where: str) -> Self:
        """These settings with the gains of the laws that a table names."""
        mine, grown = table.get("controller"), self
        for key, _, known in _OWN:
            path = f"controller.{key}"
            name = table.get(path, mine.get(key) if isinstance(mine, Mapping) else None)
            # A wrong word is refused where the table is read.
            if isinstance(name, str) and name not in known and outside.is_name(name):
                grown = grown._with(key, name, f"{where}, {path}")
        return grown

    def joined(self, names: str, where: str) -> Self:
        """These settings with other laws."""
        joined = self
        for name in names.split(","):
            fine = name in (*MICRO_LAWS, *outside.FINE, *self.also().get("micro_law", ()))
            joined = joined._with("micro_law" if fine else "macro_law", name, where)
        return joined

    def _with(self, key: str, name: str, where: str) -> Self:
        _, gains, known = next(row for row in _OWN if row[0] == key)
        if name in known or name in self.also().get(key, ()):
            chosen: dict[str, Any] = {key: name}
            return self._replace(**chosen)
        if not outside.is_name(name):
            every = (
                *macro.NAMES,
                *MICRO_LAWS,
                *outside.offered_laws(),
                *outside.offered_laws(fine=True),
            )
            raise InputError(where, printable(name), f"{nearest(name, every)}; or {outside.FORM}")
        law = outside.suitable_law(name, key.partition("_")[0], where)
        new: dict[str, Any] = {key: name, gains: law.gains()}
        return self._replace(**new)

    def problems(self) -> list[tuple[str, Any, str]]:
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

    def unstable(self) -> list[tuple[str, Any, str]]:
        """Gains that are unstable on the nominal bench; refused from live clients."""
        loops = (stability.problem(law, getattr(self, law.field)) for law in LAWS)
        return [each for each in loops if each is not None] + micro_stability.problems(self)


def prepare(
    spec: Control, fan: bool = False, table: Calibration | None = None, pitch: float = PITCH
) -> Supervisor:
    own = spec.macro_law not in macro.NAMES
    chosen: Law | StageLaw
    if own:  # found again by its name, in a process that was given these settings
        chosen = outside.find(spec.macro_law, "macro_law")
        law, scale = SHIPPED, pitch if chosen.unit == "m" else 1.0
    else:
        law, scale = macro.NAMES.index(spec.macro_law), 1.0
        chosen = LAWS[law]
    lifted = spec.dead_zone_inverse == "on" or (
        spec.dead_zone_inverse == "as designed" and chosen.compensated
    )
    gains = tuple(getattr(spec, each.field) for each in LAWS)
    fine: tuple[Any, ...] = ()
    if spec.micro_law in MICRO_LAWS:
        one = PiAntiWindup(*getattr(spec, spec.micro_law.replace("-", "_")))
    else:  # the PI's place has the limits of a law by the contract
        outside.find(spec.micro_law, "micro_law")
        fine, one = micro.prepare(spec.fine), PiAntiWindup(0.0, 0.0, 0.0, 0.0, spec.ctrl_limit)
    return Supervisor(
        MacroLaw(
            law,
            spec.dead_zone if lifted else 0.0,
            spec.motor_limit,
            (*gains, spec.own) if own else gains,
            scale,
        ),
        one,
        spec.sequence,
        calibration.default_calibration() if table is None else table,
        1.0 if fan else 0.0,
        fine,
    )
