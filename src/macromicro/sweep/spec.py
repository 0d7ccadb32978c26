"""What a sweep is: a TOML file that names a job, its options, and the parameters to vary.

job = "macro-model"
method = "lhs"                  # grid, random, lhs or sobol
samples = 1000                  # a grid has its steps instead
seed = 1
metrics = ["settling_time"]     # all of the job's without it

[parameters."friction.coulomb"]
low = "8 N"
high = "15 N"
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.errors import InputError
from macromicro.parameters import Entry, entries
from macromicro.sweep.axis import Axis, nearest, read, unknown_key, whole
from macromicro.textfile import printable, read_text, read_toml

if TYPE_CHECKING:
    from macromicro.batch import Job, Metric

WHAT = "a sweep (.toml)"
METHODS = ("grid", "random", "lhs", "sobol")
MAX_VARIANTS = 10**12
MAX_SEED = 2**63 - 1
MAX_SOBOL, MAX_WIDTH = 2**30, 21_201  # points and dimensions that scipy's sequence has
_KEYS = ("job", "method", "samples", "seed", "metrics", "options", "parameters")

Factory = Callable[..., "Job"]


class Spec(NamedTuple):
    """A sweep that has been checked: plain values, so that it travels to other processes.

    `options`: of the job, as pairs. `seed`: of the sampling. `metrics`: the names of the
    chosen ones and `columns` their places among the job's. `variants`: how many.
    """

    job: str
    options: tuple[tuple[str, Any], ...]
    method: str
    seed: int
    metrics: tuple[str, ...]
    columns: tuple[int, ...]
    axes: tuple[Axis, ...]
    variants: int

    @property
    def canonical(self) -> dict[str, Any]:
        """Everything that decides the results, by the keys of the file, in stored units."""
        told: dict[str, Any] = {
            "job": self.job,
            "method": self.method,
            "samples": self.variants,
            "metrics": list(self.metrics),
        }
        if self.method != "grid":
            told["seed"] = self.seed
        told |= {f"options.{name}": value for name, value in sorted(self.options)}
        for axis in self.axes:
            one = list(axis.levels) if axis.levels else [axis.low, axis.high, axis.scale]
            told[f"parameters.{axis.path}"] = one
        told["order"] = [axis.path for axis in self.axes]
        return told

    @property
    def digest(self) -> str:
        """SHA-256 of the canonical spec, in hexadecimal."""
        text = json.dumps(self.canonical, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def load(path: Path, factory: Factory) -> tuple[Spec, str]:
    """The sweep in the TOML file at `path`, and the file's text.

    `factory`: makes a job from its name and options, as `batch.job`. Raises `InputError`
    with file and key: unknown keys, jobs, options, metrics and parameters (with the nearest
    names), bad values and ranges, a sweep of no variants.
    """
    file = printable(path, 300)
    if path.suffix.lower() != ".toml" and not path.is_dir():
        found = f"suffix {printable(path.suffix)}" if path.suffix else "no suffix"
        raise InputError(file, found, WHAT)
    raw = read_toml(path, WHAT)
    return _checked(raw, file, factory), read_text(path, WHAT)


def _checked(raw: dict[str, Any], file: str, factory: Factory) -> Spec:
    unknown_key(raw, _KEYS, f"{file}, ")
    options = _options(raw.get("options", {}), f"{file}, options")
    name = raw.get("job")
    if not isinstance(name, str):
        raise InputError(f"{file}, job", _found(name), "the name of a job, as text")
    job = _made(name, options, file, factory)
    method = raw.get("method", "grid" if "samples" not in raw else None)
    if method not in METHODS:
        raise InputError(f"{file}, method", _found(method), f"one of {', '.join(METHODS)}")
    metrics = _metrics(raw.get("metrics"), job.metrics, f"{file}, metrics")
    axes = tuple(_axes(raw.get("parameters"), job, f"{file}, parameters", grid=method == "grid"))
    count = _count(raw, method, axes, file)
    seed = whole(raw.get("seed", 0), 0, MAX_SEED, f"{file}, seed")
    names = [m.name for m in job.metrics]
    columns = tuple(names.index(m) for m in metrics)
    return Spec(name, options, method, seed, metrics, columns, axes, count)


def _made(name: str, options: tuple[tuple[str, Any], ...], file: str, factory: Factory) -> Job:
    """The job, or the file's name before what is wrong with its name or options."""
    try:
        return factory(name, **dict(options))
    except InputError as error:
        raise InputError(f"{file}, {error.where}", error.value, error.accepted) from None
    except TypeError as error:  # an option that the job has not
        accepted = f"options that the job {name!r} has"
        raise InputError(f"{file}, options", printable(error, 200), accepted) from None


def _count(raw: dict[str, Any], method: str, axes: tuple[Axis, ...], file: str) -> int:
    if method == "grid":
        if "samples" in raw:
            accepted = "no samples: a grid has its steps"
            raise InputError(f"{file}, samples", _found(raw["samples"]), accepted)
        count = math.prod(len(axis.levels) for axis in axes)
        if count > MAX_VARIANTS:
            raise InputError(f"{file}, parameters", f"{count} variants", f"at most {MAX_VARIANTS}")
        return count
    if method == "sobol" and len(axes) > MAX_WIDTH:
        accepted = f"at most {MAX_WIDTH} for sobol"
        raise InputError(f"{file}, parameters", f"{len(axes)} parameters", accepted)
    most = MAX_SOBOL if method == "sobol" else MAX_VARIANTS
    return whole(raw.get("samples"), 1, most, f"{file}, samples")


def _options(raw: object, where: str) -> tuple[tuple[str, Any], ...]:
    if not isinstance(raw, dict):
        raise InputError(where, printable(raw), "a table [options]")
    for key, value in raw.items():
        if not isinstance(value, bool | int | float | str):
            raise InputError(f"{where}.{printable(key)}", printable(value), "text or a number")
    return tuple(sorted(raw.items()))


def _metrics(raw: object, known: tuple[Metric, ...], where: str) -> tuple[str, ...]:
    names = tuple(m.name for m in known)
    if raw is None:
        return names
    if not isinstance(raw, list) or not raw:
        raise InputError(where, _found(raw), f"a list of {', '.join(names)}")
    for name in raw:
        if name not in names:
            raise InputError(where, printable(name), nearest(str(name), names))
    if len(set(raw)) < len(raw):
        raise InputError(where, printable(raw, 200), "each metric once")
    return tuple(raw)


def _axes(raw: object, job: Job, where: str, *, grid: bool) -> Iterator[Axis]:
    known = {entry.path: entry for entry in entries(job.base())}
    if not isinstance(raw, dict) or not raw:
        found = "no parameters" if raw in (None, {}) else printable(raw)
        raise InputError(where, found, "one table [parameters.NAME] or more")
    seen: set[str] = set()
    for path, table in _leaves(raw, "", known, where, job.name):
        if path in seen:
            raise InputError(f"{where}.{path}", "stands twice", "each parameter once")
        seen.add(path)
        yield read(table, known[path], f"{where}.{path}", grid=grid)


def _leaves(
    table: dict[str, Any], prefix: str, known: dict[str, Entry], where: str, job: str
) -> Iterator[tuple[str, object]]:
    """Known paths and what the file says of each, in the file's order; nested or dotted."""
    for key, value in table.items():
        path = f"{prefix}{key}"
        if path in known:
            yield path, value
        elif any(p.startswith(f"{path}.") for p in known) and isinstance(value, dict):
            yield from _leaves(value, f"{path}.", known, where, job)
        else:
            hint = f" (`macromicro sweep {job} --list` lists all)"
            accepted = nearest(path, tuple(known), hint)
            raise InputError(f"{where}.{printable(path)}", "unknown parameter", accepted)


def _found(raw: object) -> str:
    return "nothing" if raw is None else printable(raw)
