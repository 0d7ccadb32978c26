"""The actuator model of the law `inverse`: settings, and tables for the kernels."""

from __future__ import annotations

import json
import math
from importlib import resources
from itertools import pairwise
from typing import Annotated, Any, NamedTuple

import numpy as np

from macromicro.arrays import Array
from macromicro.columns import Meaning
from macromicro.errors import InputError, ProblemError
from macromicro.hysteresis import Everett
from macromicro.hysteresis.everett import lookup
from macromicro.models.actuator import Hysteresis
from macromicro.models.heating import Ladder
from macromicro.models.stressed import Stressed
from macromicro.schema.par import Par

_FIT = "identify actuator, on the shipped bench"
_TUNED = "tuned on the shipped bench"
_HERE = "controller.fine"
_FOUND = json.loads(resources.files(__package__).joinpath("shipped.json").read_text("utf-8"))


def _time(meaning: str, source: str = _TUNED) -> Par:
    return Par("s", meaning, source, shown="ms", lo=0.0, hi=10.0)


class Inverse(NamedTuple):
    """Driver, heat and relays as identified, and the law's gains.

    Heat is counted in K: 1 K of it warms the wires by 1 K in the end (`models.heating.Ladder`).
    """

    volts: Annotated[tuple[float, ...], Par("V", "points of the heat map: CTRL", _FIT, lo=0.0)] = (
        tuple(_FOUND["volts"])
    )
    heat: Annotated[
        tuple[float, ...], Par("K", "heat there: final warming of the wires", _FIT, lo=0.0)
    ] = tuple(_FOUND["heat"])
    lag: Annotated[float, _time("lag of the driver", _FIT)] = _FOUND["lag"]
    sensor: Annotated[float, _time("lag of the position's sensor", _FIT)] = _FOUND["sensor"]
    c1: Annotated[float, Par("s", "heat capacity of the wires", _FIT, positive=True)] = _FOUND["c1"]
    r1: Annotated[float, Par("1", "resistance wires to plates", _FIT, positive=True)] = _FOUND["r1"]
    c2: Annotated[float, Par("s", "heat capacity of the plates", _FIT, positive=True)] = _FOUND[
        "c2"
    ]
    r2: Annotated[float, Par("1", "resistance plates to body", _FIT, positive=True)] = _FOUND["r2"]
    c3: Annotated[float, Par("s", "heat capacity of the body", _FIT, positive=True)] = _FOUND["c3"]
    latent: Annotated[float, Par("K", "latent heat over the wires' capacity", _FIT, lo=0.0)] = (
        _FOUND["latent"]
    )
    shift: Annotated[float, Par("K", "rise of the thresholds from the kiln to the stage", _FIT)] = (
        _FOUND["shift"]
    )
    stiffening: Annotated[
        float, Par("K/m", "rise of the thresholds with the contraction", _FIT, shown="K/mm", lo=0.0)
    ] = _FOUND["stiffening"]
    ambient: Annotated[float, Par("degC", "room temperature", _FIT, lo=-40, hi=80)] = 25.0
    cut_on: Annotated[
        float, Par("m", "contraction that closes CONTRACT", _FIT, shown="mm", positive=True)
    ] = _FOUND["cut_on"]
    cut_off: Annotated[
        float, Par("m", "contraction that opens it again", _FIT, shown="mm", positive=True)
    ] = _FOUND["cut_off"]
    coldest: Annotated[float, Par("degC", "lowest threshold of the relays", _FIT)] = _FOUND[
        "coldest"
    ]
    spacing: Annotated[
        float, Par("K", "from one threshold of the relays to the next", _FIT, positive=True)
    ] = _FOUND["spacing"]
    low: Annotated[float, Par("m", "place with all relays down", _FIT, shown="mm")] = _FOUND["low"]
    span: Annotated[
        float, Par("m", "distance to the place with all relays up", _FIT, shown="mm", positive=True)
    ] = _FOUND["span"]
    relays: Annotated[
        tuple[float, ...],
        Par("1", "Everett table, row by row below its diagonal", _FIT, lo=0.0, hi=1.0),
    ] = tuple(_FOUND["relays"])
    reach: Annotated[float, _time("in which the missing heat is to be there")] = 3e-3
    quick: Annotated[float, _time("filter of the offset after a step")] = 10e-3
    calm: Annotated[float, _time("filter of the offset later")] = 25e-3
    settle: Annotated[float, _time("from a step to the calm filter")] = 0.3
    floor: Annotated[float, Par("K/s", "rate of heat content at the target", _TUNED, lo=0.0)] = 5.0
    rise: Annotated[
        float,
        Par("K/(m*s)", "rate of heat content for a gap", _TUNED, shown="K/(mm*s)", lo=0.0),
    ] = 1e7
    doubt_base: Annotated[
        float, Par("K", "uncertainty of the base temperature", _TUNED, lo=0.0)
    ] = 6.0
    doubt_heat: Annotated[float, Par("1", "uncertainty of the heat", _TUNED, lo=0.0)] = 0.06
    doubt_loss: Annotated[float, Par("1", "uncertainty of the wires' loss", _TUNED, lo=0.0)] = 0.12
    doubt_lag: Annotated[float, _time("uncertainty of the lags together")] = 2e-3
    forget: Annotated[
        float,
        Par("s", "motion after which the uncertainty is back", _TUNED, positive=True),
    ] = 10.0
    step: Annotated[
        float, Par("V", "step of the D/A", "MultiQ-3 board, Section 3.3", shown="mV", lo=0.0)
    ] = 10.0 / 4096.0

    def problems(self) -> list[tuple[str, Any, str]]:
        found: list[tuple[str, Any, str]] = []
        if len(self.volts) != len(self.heat) or len(self.volts) < 2:
            found.append(
                ("heat", f"{len(self.heat)} values", f"as many as volts has, {len(self.volts)}")
            )
        for name, row in (("volts", self.volts), ("heat", self.heat)):
            if any(b < a for a, b in pairwise(row)):
                found.append((name, "values that fall", "values that rise"))
        if self.r1 + self.r2 >= 1.0:
            found.append(("r1", self.r1, "below 1 - r2: the three resistances make 1"))
        if self.cut_off > self.cut_on:
            found.append(("cut_off", self.cut_off, "at most cut_on"))
        if nodes(len(self.relays)) < 2:
            found.append(("relays", f"{len(self.relays)} values", "n (n - 1) / 2 values"))
        return found


class Prepared(NamedTuple):
    model: Annotated[Stressed, Meaning("driver, heat and relays; places in mm")]
    sensor: Annotated[float, Meaning("as in Inverse", "s")]
    reach: Annotated[float, Meaning("as in Inverse", "s")]
    quick: Annotated[float, Meaning("as in Inverse", "s")]
    calm: Annotated[float, Meaning("as in Inverse", "s")]
    settle: Annotated[float, Meaning("as in Inverse", "s")]
    floor: Annotated[float, Meaning("", "K/s")]
    rise: Annotated[float, Meaning("", "K/(mm s)")]
    doubts: Array
    forget: float
    step: Annotated[float, Meaning("", "V")]


def nodes(relays: int) -> int:
    n = round(0.5 + math.sqrt(0.25 + 2.0 * relays))
    return n if n * (n - 1) == 2 * relays else 0


def everett(p: Inverse) -> Everett:
    n = nodes(len(p.relays))
    if n < 2:
        found = f"there are {len(p.relays)} values"
        raise ProblemError(f"{_HERE}.relays", found, "Give n (n - 1) / 2 of them, row by row.")
    values = np.zeros((n, n))
    values[np.tril_indices(n, -1)] = p.relays
    return Everett(p.coldest, p.spacing, n, values)


def prepare(p: Inverse) -> Prepared:
    """Tables for the kernels; places in mm."""
    for name, value, accepted in p.problems():
        raise InputError(f"{_HERE}.{name}", value, accepted)
    model = Stressed(
        np.array(p.volts, dtype=np.float64),
        np.array(p.heat, dtype=np.float64),
        p.lag,
        Ladder(p.c1, p.r1, p.c2, p.r2, p.c3, 1.0 - p.r1 - p.r2),
        p.latent,
        p.shift,
        1e-3 * p.stiffening,
        1e3 * p.cut_on,
        1e3 * p.cut_off,
        p.ambient,
        Hysteresis(everett(p), 1e3 * p.low, 1e3 * p.span),
    )
    return Prepared(
        model,
        p.sensor,
        p.reach,
        p.quick,
        p.calm,
        p.settle,
        p.floor,
        1e-3 * p.rise,
        np.array([p.doubt_base, p.doubt_heat, p.doubt_loss, p.doubt_lag]),
        p.forget,
        p.step,
    )


def gains(model: Stressed, sensor: float, rms: float, spacing: float = 3.0) -> Inverse:
    """The settings of an identified actuator, from a fit with an rms error in mm."""
    h, n = model.hysteresis, model.ladder
    table = h.table
    width = table.step * (table.n - 1)
    count = math.ceil(width / spacing) + 1
    step = width / (count - 1)
    at = [table.lo + i * step for i in range(count)]
    relays = [round(lookup(table, at[i], at[j]), 5) for i in range(count) for j in range(i)]
    return Inverse(
        tuple(float(v) for v in model.volts),
        tuple(float(v) for v in np.maximum.accumulate(model.heat)),
        model.lag, sensor, n.c1, n.r1, n.c2, n.r2, n.c3, model.latent, model.shift,
        1e3 * model.stiffening, model.ambient, 1e-3 * model.cut_on, 1e-3 * model.cut_off,
        table.lo, step, 1e-3 * h.low, 1e-3 * h.span, tuple(relays),
        doubt_base=rms * width / h.span, doubt_heat=0.0, doubt_loss=0.0, doubt_lag=0.0,
    )  # fmt: skip
