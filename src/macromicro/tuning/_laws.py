"""The searched gains of a control law, their bounds and scales.

A design is a row of numbers from 0 to 1, one for each `Knob`; `decoded` converts designs to
gains. A gain above zero is searched on a logarithmic scale, a decade either way, within
the bounds of its `Par`. The two taps of a PD are nearly opposite, so static gain and
derivative time (`PdTaps`) are searched instead.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.control import outside
from macromicro.control.macro import NAMES as MACRO_LAWS
from macromicro.control.settings import MICRO_LAWS, Control
from macromicro.design.margins import PdTaps
from macromicro.errors import InputError, ProblemError
from macromicro.nominal import PERIOD
from macromicro.sampling import scaled
from macromicro.schema.par import Entry, entries
from macromicro.schema.text import printable
from macromicro.units import convert

DECADE = 10.0
LONGEST_DERIVATIVE = 0.05  # s; five times that of (4.10)
DT = PERIOD
_FIXED = ("low", "high")  # limits of the effort belong to the driver, not to the tuning
DIGITS = 8  # of a gain, as it is tried, shown and written
OWN = "own"  # the set of a law of another package
_PD = ("now", "before")


class Knob(NamedTuple):
    name: str  # for a person
    unit: str  # of the next three
    # low, high: bounds
    low: float
    high: float
    present: float  # where it stands
    log: bool  # searched on a logarithmic scale


class Law(NamedTuple):
    name: str  # as settings name it
    stage: str  # that it drives
    field: str  # its set within `controller`
    gains: tuple[str, ...]  # the gains' names there
    knobs: tuple[Knob, ...]  # what is searched
    sizes: tuple[float, ...]  # how many stored units of each gain are one that a person reads

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(f"controller.{self.field}.{gain}" for gain in self.gains)

    @property
    def chosen(self) -> tuple[str, ...]:
        """The same, and the path of the choice of this law."""
        return (f"controller.{self.stage}_law", *self.paths)

    def decoded(self, designs: Array) -> Array:
        values = np.stack(
            [scaled(designs[:, i], k.low, k.high, log=k.log) for i, k in enumerate(self.knobs)],
            axis=1,
        )
        if self.gains != _PD or self.field == OWN:
            stored: Array = values * np.array(self.sizes)
            return stored
        share = values[:, 1] / DT
        return np.stack((values[:, 0] * (1.0 + share), -values[:, 0] * share), axis=1)

    def rounded(self, gains: Array) -> Array:
        """Gains rounded as they are printed and written."""
        sizes = np.array(self.sizes)
        shown = [[float(f"{g:.{DIGITS}g}") for g in row] for row in (gains / sizes).tolist()]
        found: Array = np.array(shown) * sizes
        return found

    def present(self) -> Array:
        """The design nearest to the law's gains."""
        return np.array([_place(k, k.present) for k in self.knobs])


def names(stage: str) -> tuple[str, ...]:
    return MACRO_LAWS if stage == "macro" else MICRO_LAWS


def find(stage: str, name: str | None, control: Control) -> Law:
    known = names(stage)
    chosen = name if name is not None else getattr(control, f"{stage}_law")
    own = stage == "macro" and chosen != "" and chosen == outside.of(control.own)
    if chosen not in known and not own:
        raise InputError("--law", printable(chosen), f"one of {', '.join(known)}")
    field = OWN if own else chosen.replace("-", "_")
    mine = getattr(control, field)
    found = [e for e in entries(mine) if e.path not in _FIXED and e.par.lo < e.par.hi]
    gains = tuple(e.path for e in found)
    sizes = tuple(convert(1.0, e.par.read_in, e.par.unit) for e in found)
    if gains == _PD and not own:
        return Law(chosen, stage, field, gains, _pd_knobs(mine), sizes)
    default = type(mine)()
    knobs = tuple(_knob(e, getattr(default, e.path)) for e in found)
    return Law(chosen, stage, field, gains, knobs, sizes)


def with_gains(control: Control, law: Law, gains: Array) -> Control:
    values = dict(zip(law.gains, (float(g) for g in gains), strict=True))
    changed: Any = getattr(control, law.field)._replace(**values)
    return control._replace(**{f"{law.stage}_law": law.name, law.field: changed})


def gains_of(control: Control, law: Law) -> Array:
    mine = getattr(control, law.field)
    return np.array([getattr(mine, name) for name in law.gains])


def _pd_knobs(taps: Any) -> tuple[Knob, Knob]:
    mine = PdTaps(*taps)
    whole = (
        mine.proportional if mine.proportional > 0.0 else PdTaps(*Control().pd_tuned).proportional
    )
    held = mine.derivative_time(DT) if mine.proportional > 0.0 else 0.0
    return (
        Knob("static gain", "V/count", whole / DECADE, whole * DECADE, whole, True),
        Knob("derivative time", "s", 0.0, LONGEST_DERIVATIVE, held, False),
    )


def _knob(entry: Entry, default: float) -> Knob:
    par = entry.par
    if not max(entry.value, default) > 0.0:
        if not math.isfinite(par.lo) or not math.isfinite(par.hi):
            remedy = "Give a default above zero, or both bounds in its Par."
            raise ProblemError(f"gain {entry.path}", f"its default is {entry.value:g}", remedy)
        low, high = par.given(par.lo), par.given(par.hi)
        return Knob(entry.path, par.read_in, low, high, par.given(entry.value), False)
    present = par.given(entry.value if entry.value > 0.0 else default)
    low, high = max(present / DECADE, par.given(par.lo)), min(present * DECADE, par.given(par.hi))
    return Knob(entry.path, par.read_in, low, high, present, True)


def _place(knob: Knob, value: float) -> float:
    if knob.log:
        share = math.log(value / knob.low) / math.log(knob.high / knob.low)
    else:
        share = (value - knob.low) / (knob.high - knob.low)
    return min(max(share, 0.0), 1.0)
