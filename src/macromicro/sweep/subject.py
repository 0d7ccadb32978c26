"""What a spec says of its job: the name, options, the settings to start from."""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro import joining
from macromicro.batch.stage_job import StageJob
from macromicro.control import outside
from macromicro.control.macro import NAMES
from macromicro.errors import InputError
from macromicro.machines import owned
from macromicro.machines.tree import is_own, joined
from macromicro.schema.config import difference, load_overrides
from macromicro.schema.keys import unknown
from macromicro.schema.par import Entry, Par, entries
from macromicro.schema.text import printable
from macromicro.settings import Settings, chosen

if TYPE_CHECKING:
    from macromicro.batch import Job

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
    """What a spec says of its job.

    Attributes
    ----------
    job : Job
        The job.
    options : tuple of (str, Any)
        That make it again, settings included.
    files : tuple of (str, str)
        What files that it names say: key of the spec and what stands there.
    parameters : dict of str to Entry
        Those that can be varied.
    """

    job: Job
    options: Options
    files: tuple[tuple[str, str], ...]
    parameters: dict[str, Entry]


def read(raw: dict[str, Any], path: Path, factory: Factory, law: str | None = None) -> Subject:
    """Read what a spec says of its job.

    Parameters
    ----------
    raw : dict
        The spec.
    path : Path
        Its file.
    factory : callable
        Makes a job from its name and options.
    law : str or None
        The macro-stage's, as the option ``--law``; None: that of the settings.

    Returns
    -------
    Subject
        The job, checked.

    Raises
    ------
    InputError
        With file and key: no or an unknown job, an unknown option or one of the wrong kind, what is
        wrong with the settings file.
    """
    file = printable(path, 300)
    name = raw.get("job")
    if not isinstance(name, str):
        found = "nothing" if name is None else printable(name)
        raise InputError(f"{file}, job", found, "the name of a job, as text")
    try:
        job = factory(name)
    except InputError as error:
        raise InputError(f"{file}, job", printable(name), error.accepted) from None
    known = plain_options(job)
    options = _options(raw.get("options", {}), known, f"{file}, options")
    job = _made(factory, name, options, file)
    files = _contents(options)
    if "config" in raw or law is not None:
        tree = _tree(raw.get("config"), path, job, law)
        changed = difference(tree, job.base()).items()
        files += tuple((f"config {key}", text) for key, text in sorted(changed))
        place = next(word for word in TREES if word in inspect.signature(type(job)).parameters)
        options = tuple(sorted((*options, (place, tree)), key=lambda pair: pair[0]))
        job = _made(factory, name, options, file)
    return Subject(job, options, (*files, *laws(job)), parameters(job))


def laws(job: Job) -> tuple[tuple[str, str], ...]:
    """Tell what stands for a law, or a machine, of another package that a job runs.

    Parameters
    ----------
    job : Job
        Any.

    Returns
    -------
    tuple of (str, str)
        Its name and the digest of its sources: one that changes is another sweep.
    """
    base, found = job.base(), []
    if isinstance(job, StageJob):
        names = [tree.law for tree in job.trees if is_own(tree)]
        for tree in job.trees:
            found += [each for each in owned.digests(tree) if each not in found]
        for kind in job.kinds:
            if joining.foreign(kind.advance):
                found.append((f"machine {job.name}", joining.sources(kind.advance, kind.measure)))
    else:
        own = isinstance(base, Settings) and base.controller.macro_law not in NAMES
        names = [base.controller.macro_law] if own else []
    for name in dict.fromkeys(names):
        outside.find(name, "law")
        found.append((f"law {name}", outside.digest(name)))
    return tuple(found)


def plain_options(job: Job) -> dict[str, Any]:
    """Tell the options of a job that a file can set.

    Parameters
    ----------
    job : Job
        Any.

    Returns
    -------
    dict
        Name and default.
    """
    given = inspect.signature(type(job)).parameters.values()
    return {p.name: p.default for p in given if isinstance(p.default, bool | int | float | str)}


def parameters(job: Job) -> dict[str, Entry]:
    """Tell the parameters of a job that can be varied.

    Parameters
    ----------
    job : Job
        Any.

    Returns
    -------
    dict of str to Entry
        By dotted path; beside those of its tree the seed of the noise, and the step of a job that
        has none in its tree.
    """
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


def _contents(options: Options) -> tuple[tuple[str, str], ...]:
    """Digests of the files that options name: a programme that changes is another sweep."""
    found = []
    for key, value in options:
        if isinstance(value, str) and value.endswith(_READ) and Path(value).is_file():
            digest = hashlib.sha256(Path(value).read_bytes()).hexdigest()
            found.append((f"content of options.{key}", digest))
    return tuple(found)


def _made(factory: Factory, name: str, options: Options, file: str) -> Job:
    """The job; `InputError` with the file's name for what it says of its options."""
    try:
        return factory(name, **dict(options))
    except InputError as error:
        where = f"{file}, options.{error.where}"
        raise InputError(where, error.value, error.accepted) from None


def _tree(raw: object, path: Path, job: Job, law: str | None) -> Any:
    """The job's parameters with what the settings file beside the spec says, under a law."""
    base = job.base()
    if law is not None:
        if isinstance(job, StageJob):
            if len(job.trees) > 1:
                accepted = "no such option: the settings file says the law of each axis"
                raise InputError("--law", printable(law), accepted)
            base = joined(base, law, "--law")
        elif not isinstance(base, Settings):
            raise InputError("--law", printable(law), f"a job on a bench; {job.name} is none")
        if raw is None:
            return base if isinstance(job, StageJob) else chosen(base, None, law)
    if not isinstance(raw, str) or "\0" in raw:
        where = f"{printable(path, 300)}, config"
        raise InputError(where, printable(raw), "the name of a settings file (.toml)")
    place = path.parent / raw
    if isinstance(job, StageJob):
        tree = load_overrides(place, base, job.name)
        return tree if law is None else joined(tree, law, "--law")
    return load_overrides(place, base) if law is None else chosen(base, place, law)
