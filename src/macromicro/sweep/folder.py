"""The folder of a sweep: what is in it, who may write to it, and whether it can be resumed.

sweep.toml       the spec, as it was given
sweep.json       what was swept, with which version, and how it went
journal/         finished blocks, one file per worker; gone when the results are complete
results.parquet  the results, once all variants are finished
sweep.png        their figure; or as SVG or PDF
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from macromicro.drawing import files
from macromicro.errors import InputError
from macromicro.runs.folder import ACCEPTED, holder
from macromicro.schema.text import printable
from macromicro.sweep import journal
from macromicro.sweep.origin import Code
from macromicro.sweep.spec import Spec

SPEC = "sweep.toml"
SUMMARY = "sweep.json"
JOURNAL = "journal"
RESULTS = "results.parquet"
_PATIENCE = 10.0  # s for the workers of a killed run to notice that it is gone
FIGURES = files.names(["sweep"])
_OWN = (SPEC, SUMMARY, RESULTS, *FIGURES)
_ROW = 8  # bytes of a number


def needed_bytes(spec: Spec, left: int) -> int:
    """Tell what a sweep still needs on the disk.

    Parameters
    ----------
    spec : Spec
        The sweep.
    left : int
        Variants that are not computed yet.

    Returns
    -------
    int
        Bytes at most: their journal and, beside it, the results of all.
    """
    columns = 1 + len(spec.axes) + len(spec.metrics)
    return _ROW * (spec.variants * columns + left * (len(spec.metrics) + 1)) + 1_000_000


def prepare(
    place: Path, spec: Spec, text: str, code: Code, *, resume: bool, overwrite: bool
) -> None:
    """Make the folder's files for a new sweep, or see that this one can be resumed.

    Parameters
    ----------
    place : Path
        The folder.
    spec : Spec
        The sweep.
    text : str
        Of its file.
    code : Code
        That computes it here.
    resume, overwrite : bool
        Go on with what is there; replace what a sweep wrote there.

    Raises
    ------
    InputError
        The folder is in use, of another spec, of other code or another sampler than `code`, or it
        has content and neither `resume` nor `overwrite` is asked for.
    """
    where = f"--out {printable(place, 300)}"
    content = {p.name for p in place.iterdir()} if place.is_dir() else set()
    if resume and SUMMARY in content:
        _check_same(place, spec, code, where)
        return
    begun = resume and content <= {SPEC, JOURNAL}  # killed before it was said what to do
    if content and not overwrite and not begun:
        accepted = "a new or empty folder, --resume or --overwrite"
        raise InputError(where, "exists already", accepted)
    for name in (*_OWN, JOURNAL):  # of the right kind, before anything is removed
        path = place / name
        if path.exists() and path.is_dir() != (name == JOURNAL):
            raise InputError(f"{where}, {name}", "not of a sweep", "a folder of a sweep")
    (place / JOURNAL).mkdir(parents=True, exist_ok=True)
    with alone(place):
        for name in (RESULTS, SUMMARY, *FIGURES):  # without a summary nothing is resumed
            (place / name).unlink(missing_ok=True)
        for path in (place / JOURNAL).glob(f"*{journal.SUFFIX}"):
            path.unlink()
        (place / SPEC).write_text(text, encoding="utf-8")
        write_json(place / SUMMARY, {"state": "begun", **origin(spec, code)})


def origin(spec: Spec, code: Code) -> dict[str, Any]:
    """Tell what decides the results.

    Parameters
    ----------
    spec : Spec
        The sweep.
    code : Code
        That computes it.

    Returns
    -------
    dict
        Version, sources, sampler, digest and canonical spec.
    """
    return {**code._asdict(), "digest": spec.digest, "spec": spec.canonical}


def _check_same(place: Path, spec: Spec, code: Code, where: str) -> None:
    record = summary(place, where)
    if record["version"] != code.version:
        raise InputError(
            f"{where}, version",
            record["version"],
            f"{code.version}, which this is: install that one to go on, or --overwrite",
        )
    if record.get("sampler") != code.sampler:
        raise InputError(
            f"{where}, sampler",
            record.get("sampler", "none: of an earlier macromicro, which drew other points"),
            f"{code.sampler}, which draws here: install that one to go on, or another --out, "
            "or --overwrite",
        )
    if record["digest"] == spec.digest:
        if record["sources"] == code.sources:
            return
        raise InputError(
            f"{where}, sources",
            record["sources"],
            f"{code.sources}, which these are: macromicro's files changed since that sweep "
            "began; put them back to go on, or another --out, or --overwrite",
        )
    then, now = record["spec"], spec.canonical
    for key in dict.fromkeys([*now, *then]):
        if key not in then or key not in now or then[key] != now[key]:
            was = printable(then.get(key, "not there"), 100)
            shown = printable(now.get(key, "not there"), 100)
            accepted = f"the spec of that folder ({SPEC} in it has {was}), another --out"
            raise InputError(f"{where}, {key}", shown, f"{accepted}, or --overwrite")
    raise InputError(where, "another spec", f"the one in its {SPEC}, or --overwrite")


def summary(place: Path, where: str) -> dict[str, Any]:
    """Read what the folder's summary says.

    Parameters
    ----------
    place : Path
        The folder.
    where : str
        For messages.

    Returns
    -------
    dict
        As `prepare` or a finished sweep wrote it.

    Raises
    ------
    InputError
        It is no sweep's.
    """
    try:
        record: dict[str, Any] = json.loads((place / SUMMARY).read_text(encoding="utf-8"))
        keys = ("state", "version", "sources", "digest", "spec")
        if isinstance(record, dict) and all(key in record for key in keys):
            return record
    except (ValueError, OSError):
        pass
    raise InputError(f"{where}, {SUMMARY}", "not of a sweep", "a sweep's folder, or --overwrite")


def write_json(path: Path, record: dict[str, Any]) -> None:
    """Write a JSON file, all or nothing.

    Parameters
    ----------
    path : Path
        The file.
    record : dict
        Its content.
    """
    fresh = path.with_name(f".{path.name}.new")
    fresh.write_text(json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    fresh.replace(path)


def drop_journal(place: Path) -> None:
    """Remove the journal, if there still is one; the results have all of it.

    Parameters
    ----------
    place : Path
        The sweep's folder.
    """
    shutil.rmtree(place / JOURNAL, ignore_errors=True)


def journals(place: Path) -> list[Path]:
    """Find the journal's files.

    Parameters
    ----------
    place : Path
        The sweep's folder.

    Returns
    -------
    list of Path
        Oldest first.
    """
    return sorted((place / JOURNAL).glob(f"*{journal.SUFFIX}"))


def next_number(folder: Path) -> int:
    """Give the number of the next journal.

    Parameters
    ----------
    folder : Path
        The journals'.

    Returns
    -------
    int
        One more than the highest number in it.
    """
    used = [int(p.stem) for p in folder.glob(f"*{journal.SUFFIX}") if p.stem.isdigit()]
    return max(used, default=0) + 1


def spans(paths: Sequence[Path], spec: Spec) -> journal.Spans:
    """Tell which variants journals have.

    Parameters
    ----------
    paths : sequence of Path
        The journals; one that is not there has none.
    spec : Spec
        The sweep.

    Returns
    -------
    ndarray, shape (n, 2)
        Merged half-open spans of indices.

    Raises
    ------
    InputError
        A journal is another sweep's.
    """
    pair, columns = np.dtype((np.int64, 2)), len(spec.metrics)
    found = [np.zeros((0, 2), dtype=np.int64)]
    for path in paths:
        if not path.exists():  # a worker may have ended before it made its own
            continue
        places = ((p.first, p.first + p.rows) for p in journal.scan(path, spec.digest, columns))
        each = np.asarray(np.fromiter(places, dtype=pair), dtype=np.int64)
        found.append(journal.merged(each.reshape(-1, 2)))
    return journal.merged(np.concatenate(found))


@contextmanager
def locked(place: Path) -> Iterator[None]:
    """Hold a share of the lock on the sweep's folder, as everybody who writes there does.

    The system takes it back when the process ends, however that was.

    Parameters
    ----------
    place : Path
        The sweep's folder.

    Yields
    ------
    None
    """
    file = os.open(place, os.O_RDONLY)
    try:
        fcntl.flock(file, fcntl.LOCK_SH)
        yield
    finally:
        os.close(file)


@contextmanager
def alone(place: Path) -> Iterator[None]:
    """Hold the lock on the sweep's folder: nobody else may begin a sweep in it.

    Within the block it is a share, so that our workers can have theirs.

    Parameters
    ----------
    place : Path
        The sweep's folder.

    Yields
    ------
    None

    Raises
    ------
    InputError
        Another run, or a worker of a killed one that has not noticed yet, is at work in it.
    """
    where = f"--out {printable(place, 300)}"
    file = os.open(place, os.O_RDONLY)
    try:
        end = time.monotonic() + _PATIENCE
        while not _taken(file, fcntl.LOCK_EX):
            if time.monotonic() > end:
                raise InputError(where, _busy(file), ACCEPTED)
            time.sleep(0.1)
        if not _taken(file, fcntl.LOCK_SH):  # another run was quicker
            raise InputError(where, _busy(file), ACCEPTED)
        yield
    finally:
        os.close(file)


def _busy(file: int) -> str:
    return f"another sweep is at work in it, or another command: {holder(file)}"


def _taken(file: int, how: int) -> bool:
    try:
        fcntl.flock(file, how | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
