"""Gains of the two-stage machine's laws that are searched, with their bounds.

A gain above zero is searched on a logarithmic scale, a decade either way, within the bounds of
its `Par`. The two taps of a PD are nearly opposite, so static gain and derivative time
(`PdTaps`) are searched instead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from macromicro.arrays import Array
from macromicro.control import outside
from macromicro.control.macro import NAMES as MACRO_LAWS
from macromicro.control.settings import MICRO_LAWS, Control
from macromicro.design.margins import PdTaps
from macromicro.errors import InputError, ProblemError
from macromicro.nominal import PERIOD
from macromicro.schema.par import Entry, entries
from macromicro.schema.text import printable
from macromicro.tuning.subject import Knob

DECADE = 10.0
LONGEST_DERIVATIVE = 0.05  # s; five times that of (4.10)
DIGITS = 8  # of a gain, as it is tried, shown and written
OWN = "own"  # the set of a law of another package
_FIXED = ("low", "high")  # limits of the effort belong to the driver, not to the tuning
_PD = ("now", "before")


class Law(NamedTuple):
    name: str  # as settings name it
    stage: str  # that it drives
    field: str  # its set within `controller`
    gains: tuple[Entry, ...]

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(f"controller.{self.field}.{gain.path}" for gain in self.gains)

    @property
    def is_pd(self) -> bool:
        return self.field != OWN and tuple(gain.path for gain in self.gains) == _PD

    def under(self, control: Control) -> Control:
        """A controller with this law chosen."""
        chosen: Any = {f"{self.stage}_law": self.name}
        return control._replace(**chosen)

    def knobs(self, control: Control) -> tuple[Knob, ...]:
        mine = getattr(control, self.field)
        if self.is_pd:
            return _pd_knobs(PdTaps(*mine))
        default = type(mine)()
        return tuple(
            _knob(gain, getattr(mine, gain.path), getattr(default, gain.path))
            for gain in self.gains
        )

    def applied(self, control: Control, values: Sequence[float]) -> Control:
        """A controller with the gains of the knobs' values."""
        if self.is_pd:
            share = values[1] / PERIOD
            taps = (values[0] * (1.0 + share), -values[0] * share)
            values = [g.par.given(tap) for g, tap in zip(self.gains, taps, strict=True)]
        rounded = [float(f"{value:.{DIGITS}g}") for value in values]
        return self.with_gains(
            control, [g.par.taken(v) for g, v in zip(self.gains, rounded, strict=True)]
        )

    def scaled(self, control: Control, factor: float) -> Control:
        """A controller with all gains of this law times a factor."""
        mine = getattr(control, self.field)
        return self.with_gains(control, [factor * getattr(mine, g.path) for g in self.gains])

    def with_gains(self, control: Control, gains: Sequence[float] | Array) -> Control:
        names = [gain.path for gain in self.gains]
        values = dict(zip(names, map(float, gains), strict=True))
        changed: Any = getattr(control, self.field)._replace(**values)
        return control._replace(**{self.field: changed})


def find(stage: str, name: str | None, control: Control) -> Law:
    known = MACRO_LAWS if stage == "macro" else MICRO_LAWS
    chosen = name if name is not None else getattr(control, f"{stage}_law")
    own = stage == "macro" and chosen != "" and chosen == outside.of(control.own)
    if chosen not in known and not own:
        raise InputError("--law", printable(chosen), f"one of {', '.join(known)}")
    field = OWN if own else chosen.replace("-", "_")
    mine = getattr(control, field)
    found = [e for e in entries(mine) if e.path not in _FIXED and e.par.lo < e.par.hi]
    return Law(chosen, stage, field, tuple(found))


def _pd_knobs(taps: PdTaps) -> tuple[Knob, Knob]:
    leads = taps.proportional > 0.0
    whole = taps.proportional if leads else PdTaps(*Control().pd_tuned).proportional
    held = taps.derivative_time(PERIOD) if leads else 0.0
    return (
        Knob("static gain", "V/count", whole / DECADE, whole * DECADE, whole),
        Knob("derivative time", "s", 0.0, LONGEST_DERIVATIVE, held, log=False),
    )


def _knob(gain: Entry, value: float, default: float) -> Knob:
    par = gain.par
    if not max(value, default) > 0.0:
        if not math.isfinite(par.lo) or not math.isfinite(par.hi):
            remedy = "Give a default above zero, or both bounds in its Par."
            raise ProblemError(f"gain {gain.path}", f"its default is {value:g}", remedy)
        low, high = par.given(par.lo), par.given(par.hi)
        return Knob(gain.path, par.read_in, low, high, par.given(value), log=False)
    present = par.given(value if value > 0.0 else default)
    low, high = max(present / DECADE, par.given(par.lo)), min(present * DECADE, par.given(par.hi))
    return Knob(gain.path, par.read_in, low, high, present)
