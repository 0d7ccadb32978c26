"""A sweep file: TOML with a job, its options, and the parameters to vary.

job = "macro-bench"
method = "lhs"                  # grid, random, lhs or sobol
samples = 1000                  # a grid has steps instead
seed = 1
metrics = ["settling_time"]     # by default all of the job's
config = "mine.toml"            # settings that all variants start from

[parameters.bench.friction]
coulomb = { low = "8 N", high = "15 N" }
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro import sampling
from macromicro.errors import InputError, ProblemError
from macromicro.schema.keys import leaves, nearest, show_value, unknown, whole
from macromicro.schema.par import Entry
from macromicro.schema.text import is_toml, printable, read_text, read_toml
from macromicro.sweeps import subject
from macromicro.sweeps._axis import Axis, read_axis
from macromicro.sweeps.subject import TREES, Factory

if TYPE_CHECKING:
    from macromicro.batch import Metric

WHAT = "a sweep (.toml)"
METHODS = ("grid", *sampling.METHODS)
MAX_VARIANTS = 10**10
MAX_SEED = 2**63 - 1
_KEYS = ("job", "method", "samples", "seed", "metrics", "config", "options", "parameters")


class Spec(NamedTuple):
    """A checked sweep as plain values, for other processes."""

    job: str  # its name
    options: tuple[tuple[str, Any], ...]  # of the job, with the settings that it starts from
    method: str  # one of `METHODS`
    seed: int  # of the sampling
    metrics: tuple[str, ...]  # the chosen ones
    columns: tuple[int, ...]  # their places among the job's
    axes: tuple[Axis, ...]  # what is varied
    variants: int  # how many
    # what the options have otherwise than by default, and digests of files that they name
    files: tuple[tuple[str, str], ...] = ()

    @property
    def canonical(self) -> dict[str, Any]:
        """Everything that determines the results, by the keys of the file, in stored units."""
        content: dict[str, Any] = {
            "job": Path(self.job).name if is_toml(self.job) else self.job,
            "method": self.method,
            "samples": self.variants,
            "metrics": list(self.metrics),
        }
        if self.method != "grid":
            content["seed"] = self.seed
        content |= {f"options.{name}": v for name, v in self.options if name not in TREES}
        content |= dict(self.files)
        for axis in self.axes:
            one = list(axis.levels) if axis.levels else [axis.low, axis.high, axis.scale]
            content[f"parameters.{axis.path}"] = one
        content["order"] = [axis.path for axis in self.axes]
        return content

    @property
    def digest(self) -> str:
        """SHA-256 of the canonical spec, in hexadecimal."""
        text = json.dumps(self.canonical, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


def load(path: Path, factory: Factory, law: str | None = None) -> tuple[Spec, str]:
    raw = read_toml(path, WHAT)
    return _check(raw, path, factory, law), read_text(path, WHAT)


def _check(raw: dict[str, Any], path: Path, factory: Factory, law: str | None) -> Spec:
    file = printable(path, 300)
    unknown(raw, _KEYS, f"{file}, ")
    name, job, options, files, known = subject.read_subject(raw, path, factory, law)
    method = raw.get("method", "grid" if "samples" not in raw else None)
    if method not in METHODS:
        raise InputError(f"{file}, method", show_value(method), f"one of {', '.join(METHODS)}")
    metrics = _metrics(raw.get("metrics"), job.metrics, f"{file}, metrics")
    where, grid = f"{file}, parameters", method == "grid"
    axes = tuple(_axes(raw.get("parameters"), known, job.name, where, grid=grid))
    count = _count(raw, method, axes, file)
    seed = whole(raw.get("seed", 0), 0, MAX_SEED, f"{file}, seed")
    names = [m.name for m in job.metrics]
    columns = tuple(names.index(m) for m in metrics)
    return Spec(name, options, method, seed, metrics, columns, axes, count, files)


def _count(raw: dict[str, Any], method: str, axes: tuple[Axis, ...], file: str) -> int:
    if method == "grid":
        if "samples" in raw:
            raise ProblemError(f"{file}, samples", "not allowed for a grid, which has its steps")
        count = math.prod(len(axis.levels) for axis in axes)
        if count > MAX_VARIANTS:
            remedy = f"At most {MAX_VARIANTS} can be run."
            raise ProblemError(f"{file}, parameters", f"they make {count} variants", remedy)
        return count
    if method == "sobol" and len(axes) > sampling.MAX_WIDTH:
        remedy = f"The method sobol takes at most {sampling.MAX_WIDTH}."
        raise ProblemError(f"{file}, parameters", f"there are {len(axes)}", remedy)
    count = whole(raw.get("samples"), 1, MAX_VARIANTS, f"{file}, samples")
    most, why = _most(method, len(axes))
    if count > most:
        raise InputError(f"{file}, samples", count, f"at most {most}{why}")
    return count


def _most(method: str, axes: int) -> tuple[int, str]:
    """Largest number of samples of a method for so many parameters, and the reason."""
    if method == "sobol":
        return sampling.MAX_SOBOL, " for sobol; random takes more"
    if method == "lhs":
        why = f" for lhs with {axes} parameters, all of which it keeps in memory"
        return sampling.MAX_LATIN // axes, f"{why}; sobol and random take more"
    return MAX_VARIANTS, ""


def _metrics(raw: object, known: tuple[Metric, ...], where: str) -> tuple[str, ...]:
    names = tuple(m.name for m in known)
    if raw is None:
        return names
    if not isinstance(raw, list) or not raw:
        raise InputError(where, show_value(raw), f"a list of {', '.join(names)}")
    for name in raw:
        if name not in names:
            raise InputError(where, printable(name), nearest(str(name), names))
    if len(set(raw)) < len(raw):
        raise InputError(where, printable(raw, 200), "each metric once")
    return tuple(raw)


def _axes(
    raw: object, known: dict[str, Entry], job: str, where: str, *, grid: bool
) -> Iterator[Axis]:
    if not isinstance(raw, dict) or not raw:
        empty = "no parameters" if raw in (None, {}) else printable(raw)
        raise InputError(where, empty, "one table [parameters.NAME] or more")
    hint = f"`macromicro sweep {job} --list` lists all"
    for path, table in leaves(raw, known, f"{where}.", hint).items():
        yield read_axis(table, known[path], f"{where}.{path}", grid=grid)
