"""The job of a spec: its name, options, and the settings to start from."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard

from macromicro import joining
from macromicro.control import outside
from macromicro.errors import InputError, ProblemError
from macromicro.schema.config import difference, load_overrides
from macromicro.schema.keys import unknown
from macromicro.schema.par import Entry, Par, entries
from macromicro.schema.text import is_toml, printable

if TYPE_CHECKING:
    from macromicro.batch import Job
    from macromicro.batch.variant_job import VariantJob

Factory = Callable[..., "Job"]
Options = tuple[tuple[str, Any], ...]

_READ = (".toml", ".csv")  # what a job may read
TREES = ("settings", "tree")  # what jobs call the parameters that variants start from
_KINDS = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}
# What jobs take for each variant beside their tree's parameters; an option of the same name
# is what it is without.
_BESIDE = (
    Entry("seed", Par("", "seed of the measurement noise", lo=0.0, hi=2.0**53), 0),
    Entry("reference", Par("count", "step", lo=-1e6, hi=1e6), 0.0),
)


class Subject(NamedTuple):
    name: str  # by which the factory makes the job
    job: Job
    options: Options  # that make it again, settings included
    # what files that it names say: key of the spec and what stands there
    files: tuple[tuple[str, str], ...]
    parameters: dict[str, Entry]  # those that can be varied


def read_subject(
    raw: dict[str, Any], path: Path, factory: Factory, law: str | None = None
) -> Subject:
    file = printable(path, 300)
    name = raw.get("job")
    if not isinstance(name, str):
        found = "nothing" if name is None else printable(name)
        raise InputError(f"{file}, job", found, "the name of a job, as text")
    whole = is_toml(name)
    if whole:
        name = str(path.parent / name)
        if "config" in raw:
            raise ProblemError(f"{file}, config", f"job is a settings file, {printable(name, 300)}")
    try:
        job = factory(name)
    except InputError as error:
        if whole:
            raise error.at(f"{file}, job: {error.where}") from None
        raise InputError(f"{file}, job", printable(name), error.accepted) from None
    known = plain_options(job)
    options = _options(raw.get("options", {}), known, f"{file}, options")
    job = _make_job(factory, name, options, file)
    files = _contents([("job", name), *((f"options.{key}", value) for key, value in options)])
    if "config" in raw or law is not None:
        tree = _tree(raw.get("config"), path, job, law)
        changed = difference(tree, job.base()).items()
        files += tuple((f"config {key}", text) for key, text in sorted(changed))
        place = next(word for word in TREES if word in inspect.signature(type(job)).parameters)
        options = tuple(sorted((*options, (place, tree)), key=lambda pair: pair[0]))
        job = _make_job(factory, name, options, file)
    return Subject(name, job, options, (*files, *laws(job)), parameters(job))


def laws(job: Job) -> tuple[tuple[str, str], ...]:
    """Identity of the user's law or machine that a job runs."""
    if not _runs_machine(job):
        return ()
    found = [
        (f"machine {job.name}", joining.sources(kind.advance, kind.measure)) for kind in job.kinds()
    ]
    for name in dict.fromkeys(job.laws()):
        outside.find(name, "law")
        found.append((f"law {name}", outside.digest(name)))
    return tuple(found)


def _runs_machine(job: Job) -> TypeGuard[VariantJob]:
    return hasattr(job, "laws")  # its class is known without an import of all machines


def plain_options(job: Job) -> dict[str, Any]:
    given = inspect.signature(type(job)).parameters.values()
    return {p.name: p.default for p in given if isinstance(p.default, bool | int | float | str)}


def parameters(job: Job) -> dict[str, Entry]:
    known = {entry.path: entry for entry in entries(job.base())}
    options = plain_options(job)
    beside = [e for e in _BESIDE if e.path in options and e.path not in known]
    return known | {e.path: e._replace(value=options[e.path]) for e in beside}


def _options(raw: object, known: dict[str, Any], where: str) -> Options:
    if not isinstance(raw, dict):
        raise InputError(where, printable(raw), "a table [options]")
    unknown(raw, tuple(known), f"{where}.")
    for key, value in raw.items():
        kind = type(known[key])
        right = isinstance(value, int | float) if kind is float else isinstance(value, kind)
        if not right or (isinstance(value, bool) and kind is not bool):
            raise InputError(f"{where}.{key}", printable(value), _KINDS[kind])
    return tuple(sorted(raw.items()))


def _contents(named: Iterable[tuple[str, Any]]) -> tuple[tuple[str, str], ...]:
    """Digests of the files that keys of a spec name: a changed programme is another sweep."""
    found = []
    for key, value in named:
        if isinstance(value, str) and value.endswith(_READ) and Path(value).is_file():
            digest = hashlib.sha256(Path(value).read_bytes()).hexdigest()
            found.append((f"content of {key}", digest))
    return tuple(found)


def _make_job(factory: Factory, name: str, options: Options, file: str) -> Job:
    """The job; errors in its options name the file."""
    try:
        return factory(name, **dict(options))
    except InputError as error:
        where = f"{file}, options.{error.where}"
        raise error.at(where) from None


def _tree(raw: object, path: Path, job: Job, law: str | None) -> Any:
    own = raw is not None or law is None
    if own and (not isinstance(raw, str) or "\0" in raw):
        where = f"{printable(path, 300)}, config"
        raise InputError(where, printable(raw), "the name of a settings file (.toml)")
    place = path.parent / str(raw) if own else None
    if _runs_machine(job):
        return job.loaded(place, law)
    if law is not None:
        raise ProblemError("--law", f"only with a job on a bench, not with {job.name}")
    assert place is not None
    return load_overrides(place, job.base())
