"""Do printed standard errors hold? Coverage of the intervals that `identify` prints.

    python benchmarks/intervals.py [--records 200] [--out docs/validation/coverage.json] [GROUP ...]
        [--kinds cogging ...]

Each method fits synthetic records of a known machine, disturbed in six ways; the shares of records
whose intervals hold the truth are to be 68 and 95 %. These are 1 and 1.96 standard errors to each
side, or the coverage factors that are told. `make bench-identify` runs it;
docs/make_coverage.py writes the tables of docs/validation/identification.md from it.
"""

from __future__ import annotations

import argparse
import json
import math
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import lfilter

from macromicro import identify
from macromicro.arrays import Array
from macromicro.errors import InputError
from macromicro.identify import eccentric, presliding
from macromicro.identify.heating import StepRecord, heating
from macromicro.identify.presliding_fit import presliding_drive
from macromicro.identify.runs import Run
from macromicro.identify.sprung_fit import sprung_drive
from macromicro.kernel import compiled
from macromicro.models import mass
from macromicro.models.heating import Modes, step_response
from macromicro.models.mass import Axis, acting, simulate
from macromicro.models.mass import glide as step

OUT = Path(__file__).resolve().parents[1] / "docs" / "validation" / "coverage.json"
DISTURBANCES = ("white force", "coloured force", "cogging", "slow force", "sensor", "quantised")
DT = 1e-3

AXIS = Axis(mass=4.0, viscous=25.0, coulomb=12.0, offset=2.0)
AXIS_NAMES = ("mass", "viscous", "coulomb", "offset")
SAMPLES = 8000
# A load that turns, and that gravity pulls at: 0.05 to 0.3 N m, hanging anywhere.
TURNED = Axis(mass=0.01, viscous=0.08, coulomb=0.05, offset=0.01)
# On a spring, driven at 2 to 3 Hz and left to decay at 18 Hz; forces of the latter are per mass.
SPRUNG = {
    "on a spring": Axis(mass=2.0, viscous=5.0, coulomb=3.0, offset=1.0, spring=400.0),
    "decay": Axis(mass=1.0, viscous=1.2, coulomb=0.05, spring=(2.0 * math.pi * 18.0) ** 2),
}
SPRUNG_SIZE = {"on a spring": (6.0, 1e-5), "decay": (0.05, 1e-6)}  # white force, sensor
SPRUNG_SAMPLES = 4000
# A stage on plain bearings that gives by 0.1 mm before it slides; measured to 0.1 um.
ELASTIC = presliding.Presliding(
    mass=2.0,
    viscous=15.0,
    offset=0.3,
    asymmetry=0.0,
    stribeck=0.0,
    stribeck_speed=0.01,
    stiffness=5e4,
    settling=4e-3,
    levels=np.array([5.0]),
    low=-1.0,
    high=1.0,
)
ELASTIC_NAMES = ("mass", "viscous", "offset", "stiffness", "settling", "coulomb")
ELASTIC_SIZE = (0.1, 1e-7)  # white force, sensor
# (5.6) as the bench shows it: rates in rad/s, shares of the rise. What rounding of a smooth rise
# does to a fit depends on the rise and on where the zero of the counts is: of one machine it is a
# function of the latter alone, which no interval follows. So each record is of a machine that is
# off this one.
HEATED = Modes(1.75, 0.108, 0.0099, 0.74, 0.21, 0.05)
HEATED_OFF = 0.3  # by which rates and shares are off at most, before the shares come to 1 again
HEATED_DT, HEATED_SAMPLES = 0.1, 4000
# Errors of the thermometer, and draughts: over how many s, and so many samples ahead of the record.
CORRELATED = {"coloured force": (2.0, 2000), "slow force": (60.0, 9000)}
# The thesis' macro-stage, (4.3), and the same with a second pole; 1 V is worth 165.72 counts/s.
LINEAR = {
    1: (np.array([-0.95833]), np.array([165.72])),
    2: (np.array([-1.65833, 0.670831]), np.array([40.0, 9.716])),
}
LINEAR_SAMPLES = 3000
# Disturbances that a method is not measured under.
LEFT_OUT = {"thermal, heating": {"cogging"}}
METHODS = ("least_squares", "gls", "mls", "sriv", "output_error", "box_jenkins")

# Of a method: names, truth, values, standard errors and coverage factors of its parameters.
Estimates = Iterator[tuple[str, tuple[str, ...], Array, Array, Array, Array]]


def steps(random: np.random.Generator, n: int, size: float) -> Array:
    """Inputs of both signs, each for 0.1 to 0.5 s."""
    parts: list[Array] = []
    while sum(map(len, parts)) < n:
        parts.append(np.full(int(random.integers(100, 500)), random.uniform(-size, size)))
    return np.concatenate(parts)[:n]


def force(kind: str, random: np.random.Generator, n: int, white: float) -> Array:
    """A disturbing force; `white` is the standard deviation of the white one."""
    if kind == "white force":
        return np.asarray(white * random.standard_normal(n))
    if kind == "coloured force":  # a correlation of 20 ms
        return np.asarray(
            lfilter([0.1 * white], [1.0, -0.95], random.standard_normal(n + 500))[500:]
        )
    if kind == "slow force":  # a correlation of 1 s
        start = random.standard_normal() / math.sqrt(1.0 - 0.999**2)
        walk = lfilter([1.0], [1.0, -0.999], random.standard_normal(n), zi=[0.999 * start])[0]
        return np.asarray(walk * 0.2 * white * math.sqrt(1.0 - 0.999**2))
    return np.zeros(n)


def driven(kind: str, seed: int) -> tuple[Array, Array]:
    """Force and position of an axis."""
    random = np.random.default_rng(seed)
    u = steps(random, SAMPLES, 60.0)
    if kind == "cogging":
        return u, cogged(AXIS, u, random, 1.5, (0.05, 0.08))
    x = simulate(AXIS, u + force(kind, random, SAMPLES, 6.0), DT)
    return u, measured(kind, random, x, 1e-5)


def cogged(
    axis: Axis,
    u: Array,
    random: np.random.Generator,
    size: float,
    every: tuple[float, float],
    place: float = 0.0,
) -> Array:
    """Positions from a place on, under a force of some size that repeats every so much way."""
    turn, phase = 2.0 * math.pi / random.uniform(*every), random.uniform(0.0, 2.0 * math.pi)
    x, v = np.empty(len(u)), 0.0
    for k in range(len(u)):
        x[k] = place
        push = float(u[k]) + size * math.sin(turn * place + phase)
        v, gone = step(axis, v, acting(axis, push, place, v, DT), DT)
        place += gone
    return x


def measured(kind: str, random: np.random.Generator, x: Array, noise: float) -> Array:
    """An output with noise or in counts, twice as large as the noise."""
    if kind == "sensor":
        return np.asarray(x + noise * random.standard_normal(len(x)))
    if kind == "quantised":
        pitch = 2.0 * noise
        return np.asarray(np.floor(x / pitch + random.uniform()) * pitch)
    return x


def linear(kind: str, order: int, seed: int) -> tuple[Array, Array]:
    """Input and output of a linear machine."""
    random = np.random.default_rng(seed)
    a, b = LINEAR[order]
    u = steps(random, LINEAR_SAMPLES, 2.0)
    numerator, denominator = np.r_[0.0, b], np.r_[1.0, a]
    if kind == "cogging":
        turn, phase = 2.0 * math.pi / random.uniform(50.0, 80.0), random.uniform(0.0, 6.28)
        y, place, d = np.zeros(len(u)), 0.0, np.zeros(len(u))
        for k in range(len(u)):
            past = [j for j in range(1, len(a) + 1) if k >= j]
            y[k] = sum(-a[j - 1] * y[k - j] + b[j - 1] * (u[k - j] + d[k - j]) for j in past)
            place += y[k] * DT
            d[k] = 0.1 * math.sin(turn * place + phase)
        return u, y
    disturbed = u + force(kind, random, len(u), 0.3)
    return u, measured(kind, random, np.asarray(lfilter(numerator, denominator, disturbed)), 50.0)


def drive(kind: str, seed: int) -> Estimates:
    """Both estimates of `identify drive`."""
    u, x = driven(kind, seed)
    fit = identify.drive(np.arange(len(u)) * DT, u, x, structure="coulomb")
    truth = np.array([getattr(AXIS, n) for n in AXIS_NAMES])
    for name, found in (("inverse dynamics", fit.inverse), ("output error", fit.refined)):
        yield f"drive, {name}", found.names, truth, found.values, found.std, found.factors


def turned(kind: str, seed: int) -> Estimates:
    """An eccentric load that turns, by both methods."""
    random = np.random.default_rng(seed)
    size, hangs = random.uniform(0.05, 0.3), random.uniform(-math.pi, math.pi)
    axis = TURNED._replace(sine=size * math.cos(hangs), cosine=-size * math.sin(hangs))
    u, place = steps(random, SAMPLES, 1.0), random.uniform(-math.pi, math.pi)
    if kind == "cogging":
        x = cogged(axis, u, random, 0.025, (math.radians(3.0), math.radians(5.0)), place)
    else:
        x = simulate(axis, u + force(kind, random, SAMPLES, 0.1), DT, place)
        if kind == "quantised":  # to the nearest count: the angle is from the encoder's own zero
            x = np.round(x / 2e-4) * 2e-4
        x = measured("sensor" if kind == "sensor" else "", random, x, 1e-4)
    t = np.arange(SAMPLES) * DT
    fit = identify.drive(t, u, x, structure="coulomb", eccentric=True)
    truth = np.array([*(getattr(axis, n) for n in AXIS_NAMES), size, hangs])
    for name, found in (("inverse dynamics", fit.inverse), ("output error", fit.refined)):
        values, std = eccentric.gravity_terms(found)
        values[1] = hangs + math.remainder(values[1] - hangs, 2.0 * math.pi)
        each = np.r_[found.values[: len(AXIS_NAMES)], values]
        errors = np.r_[found.std[: len(AXIS_NAMES)], std]
        factors = np.c_[
            found.factors[:, : len(AXIS_NAMES)],
            found.spread.factors(eccentric.slopes(found)),
        ]
        names = (*AXIS_NAMES, *eccentric.NAMES)
        yield f"eccentric load, {name}", names, truth, each, errors, factors


def transfer(kind: str, seed: int) -> Estimates:
    """All methods of `identify linear`, of both orders."""
    for order, (a, b) in LINEAR.items():
        u, y = linear(kind, order, seed)
        names = (*(f"{c}{k + 1}" for c in "ab" for k in range(order)), "gain")
        truth = np.r_[a, b, b.sum() / (1.0 + a.sum())]
        for method in METHODS:
            fit = getattr(identify, method)(u, y, order, order, DT)
            found, std = np.r_[fit.a, fit.b, fit.gain], np.r_[fit.std, fit.gain_std]
            if fit.doubt:  # the result says that its intervals may not hold
                std = np.full_like(std, np.nan)
            factors = np.c_[fit.factors, fit.gain_factors]
            yield f"linear, {method} of order {order}", names, truth, found, std, factors


def on_spring(kind: str, seed: int) -> Estimates:
    """A driven axis on a spring, and one that decays, each by output error."""
    for name, p in SPRUNG.items():
        random = np.random.default_rng(seed)
        n, free = SPRUNG_SAMPLES, name == "decay"
        white, noise = SPRUNG_SIZE[name]
        u = np.zeros(n) if free else steps(random, n, 30.0)
        pushed = u + force(kind, random, n, white)
        turn, phase = 2.0 * math.pi / random.uniform(0.05, 0.08), random.uniform(0.0, 6.28)
        if free:
            turn *= 100.0  # it moves that much less
        x, place, v = np.empty(n), 1e-3 if free else 0.0, 0.0
        for k in range(n):
            x[k] = place
            cog = 0.25 * white * math.sin(turn * place + phase) if kind == "cogging" else 0.0
            place, v = mass.step(p, place, v, float(pushed[k]) + cog, DT)
        if kind == "quantised":  # to the nearest count of an encoder whose zero is known
            at = random.uniform()
            y = (np.round(x / (2.0 * noise) + at) - at) * 2.0 * noise
        else:
            y = measured(kind, random, x, noise)
        run = Run(*(np.asarray(each, np.float64) for each in (np.arange(n) * DT, u, y)))
        fit = sprung_drive([run], driven=not free, spring=True, friction="coulomb")
        names = (*fit.names, "frequency")
        truth = np.array([getattr(p, n) for n in names])
        value, error, factor = fit.derived("frequency")
        values, std = np.r_[fit.values, value], np.r_[fit.std, error]
        yield f"drive, {name}", names, truth, values, std, np.c_[fit.factors, factor]


def elastic(kind: str, seed: int) -> Estimates:
    """LuGre friction: strokes, and between them wiggles that its level holds."""
    random = np.random.default_rng(seed)
    t = np.arange(SAMPLES) * DT
    on = np.sin(2.0 * math.pi * 0.11 * t + random.uniform(0.0, 6.28)) > -0.3
    u = np.where(on, 11.0 * np.sin(1.4 * math.pi * t), 3.5 * np.sin(6.2 * math.pi * t))
    white, noise = ELASTIC_SIZE
    if kind == "cogging":
        x = elastic_cogged(u, random, 0.25 * white)
    else:
        pushed = u + force(kind, random, SAMPLES, white)
        x = measured(kind, random, presliding.simulate(ELASTIC, pushed, DT), noise)
    fit = presliding_drive(t, u, x, along=1)
    names = tuple(n.replace("level 1", "coulomb") for n in fit.names)
    kept = [n in ELASTIC_NAMES for n in names]
    truth = np.array([getattr(ELASTIC, n) for n in names if n in ELASTIC_NAMES])
    told = tuple(n for n in names if n in ELASTIC_NAMES)
    values, std, factors = fit.values[kept], fit.std[kept], fit.factors[:, kept]
    yield "drive, elastic friction", told, truth, values, std, factors


def elastic_cogged(u: Array, random: np.random.Generator, size: float) -> Array:
    """Positions under a force of this size that repeats every 50 to 80 mm."""
    turn, phase = 2.0 * math.pi / random.uniform(0.05, 0.08), random.uniform(0.0, 2.0 * math.pi)
    x, place, v = np.empty(len(u)), 0.0, 0.0
    move = compiled(presliding.step)
    bristle = compiled(presliding.begin)(ELASTIC, place, v, float(u[0]) - ELASTIC.offset)
    for k in range(len(u)):
        x[k] = place
        pull = float(u[k]) + size * math.sin(turn * place + phase) - ELASTIC.offset
        v, gone, bristle = move(ELASTIC, bristle, place, v, pull, DT)
        place += gone
    return x


def heated(kind: str, seed: int) -> Estimates:
    """Three rates and shares of a step of heat, as `identify thermal` finds them."""
    if kind in LEFT_OUT["thermal, heating"]:
        return
    random = np.random.default_rng(seed)
    modes = np.array(HEATED) * (1.0 + HEATED_OFF * random.uniform(-1.0, 1.0, len(HEATED)))
    modes[3:] /= modes[3:].sum()
    t = np.arange(HEATED_SAMPLES) * HEATED_DT
    rise = 60.0 * np.asarray(step_response(Modes(*modes.tolist()), t))
    n = len(t)
    if kind == "white force":  # of the heat, through the same dynamics
        noise = 0.05 * random.standard_normal(n)
        for rate, share in zip(modes[:3], modes[3:], strict=True):
            keep = math.exp(-rate * HEATED_DT)
            rise = rise + 60.0 * share * lfilter([0.0, 1.0 - keep], [1.0, -keep], noise)
    elif kind in CORRELATED:
        time, before = CORRELATED[kind]
        keep = math.exp(-HEATED_DT / time)
        walk = lfilter([1.0], [1.0, -keep], random.standard_normal(n + before))[before:]
        rise = rise + 0.2 * math.sqrt(1.0 - keep**2) * walk
    else:
        rise = measured(kind, random, rise, 0.125)
    y = np.asarray(rise, np.float64)
    fit = heating(StepRecord(np.asarray(t, np.float64), y, y, np.zeros(n)), 60.0)
    names = tuple(f"{what} {k}" for what in ("rate", "share") for k in (1, 2, 3))
    values, std = np.array(fit.modes), np.array(fit.std)
    yield "thermal, heating", names, modes, values, std, fit.factors


GROUPS: dict[str, Callable[[str, int], Estimates]] = {
    "drive": drive,
    "eccentric": turned,
    "linear": transfer,
    "sprung": on_spring,
    "elastic": elastic,
    "thermal": heated,
}


def covered(group: str, kind: str, records: int, first: int = 0) -> list[dict[str, Any]]:
    """A row for each method and parameter under one disturbance.

    Parameters
    ----------
    group : str
        A key of `GROUPS`.
    kind : str
        One of `DISTURBANCES`.
    records : int
        How many.
    first : int, optional
        Seed of the first one.

    Returns
    -------
    list[dict[str, Any]]
        Shares in percent; real and told errors in the parameter's unit.
    """
    kept: dict[tuple[str, str], list[list[float]]] = {}
    for seed in range(first, first + records):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                for method, names, truth, values, std, factors in GROUPS[group](kind, seed):
                    table = np.stack([truth, values - truth, std, *factors], axis=1)
                    for name, row in zip(names, table.tolist(), strict=True):
                        kept.setdefault((method, name), []).append(row)
        except InputError:
            continue
    rows = []
    for (method, name), each in kept.items():
        with_error = [e for e in each if not math.isnan(e[2])]
        columns = np.array(with_error or each).T
        truth, missed, told, factors = *columns[:3], columns[3:]
        with np.errstate(invalid="ignore"):
            inside = [100.0 * float(np.mean(np.abs(missed) <= w * told)) for w in factors]
        rows.append(
            {
                "method": method, "parameter": name, "disturbance": kind, "records": len(each),
                "told_in": len(with_error),
                "one": round(inside[0], 1), "wide": round(inside[1], 1), "truth": float(truth[0]),
                "bias": float(f"{missed.mean():.3g}"), "scatter": float(f"{missed.std():.3g}"),
                "told": float(f"{np.sqrt(np.mean(told**2)):.3g}") if with_error else None,
            }
        )  # fmt: skip
    return rows


def kept(file: Path) -> list[dict[str, Any]]:
    """Rows of earlier measurements."""
    if not file.exists():
        return []
    table = json.loads(file.read_text(encoding="utf-8"))
    return [dict(zip(table["columns"], row, strict=True)) for row in table["rows"]]


def write(file: Path, rows: list[dict[str, Any]]) -> None:
    """The names of the columns once, then a line for each row, to three digits."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    lines = [
        json.dumps([_short(row.get(name)) for name in names], separators=(",", ":")) for row in rows
    ]
    head = f'{{"columns": {json.dumps(names)}, "rows": [\n'
    file.write_text(head + ",\n".join(lines) + "\n]}\n", encoding="utf-8")


def _short(value: Any) -> Any:
    return float(f"{value:.3g}") if isinstance(value, float) else value


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("groups", nargs="*", default=list(GROUPS))
    parser.add_argument("--records", type=int, default=200)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--kinds", nargs="*", default=DISTURBANCES, choices=DISTURBANCES)
    parser.add_argument("--quick", action="store_true", help="one record a group, written nowhere")
    options = parser.parse_args()
    if options.quick:
        for group in options.groups:
            covered(group, DISTURBANCES[0], 1)
        return
    rows = kept(options.out)
    for group in options.groups:
        for kind in options.kinds:
            began = time.perf_counter()
            new = covered(group, kind, options.records)
            names = {(r["method"], r["disturbance"]) for r in new}
            rows = [r for r in rows if (r["method"], r["disturbance"]) not in names] + new
            write(options.out, rows)
            print(f"{group}, {kind}: {time.perf_counter() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
