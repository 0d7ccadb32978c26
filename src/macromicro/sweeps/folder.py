"""The folder of a sweep: its files, its lock, and whether it can be resumed.

sweep.toml       the spec, as given
sweep.json       the sweep, the version of the code, and the state
journal/         finished blocks, one file per worker; removed when the results are complete
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
from macromicro.errors import ProblemError
from macromicro.runs.folder import ACCEPTED, holder
from macromicro.schema.text import printable, write_text
from macromicro.sweeps import _journal
from macromicro.sweeps._origin import Code
from macromicro.sweeps._spec import Spec

SPEC = "sweep.toml"
SUMMARY = "sweep.json"
JOURNAL = "journal"
RESULTS = "results.parquet"
_PATIENCE = 10.0  # s for the workers of a killed run to notice that it is gone
FIGURES = files.names(["sweep"])
_OWN = (SPEC, SUMMARY, RESULTS, *FIGURES)
_ROW = 8  # bytes of a number


def needed_bytes(spec: Spec, left: int) -> int:
    columns = 1 + len(spec.axes) + len(spec.metrics)
    return _ROW * (spec.variants * columns + left * (len(spec.metrics) + 1)) + 1_000_000


def prepare(
    place: Path, spec: Spec, text: str, code: Code, *, resume: bool, overwrite: bool
) -> None:
    """Make the folder's files for a new sweep, or check that this one can be resumed."""
    where = f"--out {printable(place, 300)}"
    content = {p.name for p in place.iterdir()} if place.is_dir() else set()
    if resume and SUMMARY in content:
        _check_same(place, spec, code, where)
        return
    begun = resume and content <= {SPEC, JOURNAL}  # killed before it was said what to do
    if content and not overwrite and not begun:
        raise ProblemError(
            where,
            "the folder already exists",
            "Choose another one, or add --resume or --overwrite.",
        )
    for name in (*_OWN, JOURNAL):  # of the right kind, before anything is removed
        path = place / name
        if path.exists() and path.is_dir() != (name == JOURNAL):
            raise ProblemError(f"{where}, {name}", "not part of a sweep", "Choose another folder.")
    (place / JOURNAL).mkdir(parents=True, exist_ok=True)
    with alone(place):
        for name in (RESULTS, SUMMARY, *FIGURES):  # without a summary nothing is resumed
            (place / name).unlink(missing_ok=True)
        for path in (place / JOURNAL).glob(f"*{_journal.SUFFIX}"):
            path.unlink()
        write_text(place / SPEC, text)
        write_json(place / SUMMARY, {"state": "begun", **origin(spec, code)})


def origin(spec: Spec, code: Code) -> dict[str, Any]:
    """Everything that determines the results."""
    return {**code._asdict(), "digest": spec.digest, "spec": spec.canonical}


def _check_same(place: Path, spec: Spec, code: Code, where: str) -> None:
    record = summary(place, where)
    if record["version"] != code.version:
        raise ProblemError(
            f"{where}, version",
            f"begun with macromicro {record['version']}, but this is {code.version}",
            "Install that version to resume, or add --overwrite.",
        )
    if record.get("sampler") != code.sampler:
        old = record.get("sampler", "another sampler (of an earlier version)")
        raise ProblemError(
            f"{where}, sampler",
            f"begun with {old}, but this is {code.sampler}",
            "Install that version to resume, choose another folder, or add --overwrite.",
        )
    if record["digest"] == spec.digest:
        if record["sources"] == code.sources:
            return
        raise ProblemError(
            f"{where}, sources",
            f"the files of macromicro have changed ({record['sources']} to {code.sources})",
            "Restore them to resume, choose another folder, or add --overwrite.",
        )
    then, now = record["spec"], spec.canonical
    for key in dict.fromkeys([*now, *then]):
        if key not in then or key not in now or then[key] != now[key]:
            was = printable(then.get(key, "missing"), 100)
            shown = printable(now.get(key, "missing"), 100)
            raise ProblemError(
                f"{where}, {key}",
                f"{shown} now, but {was} in the folder's {SPEC}",
                "Use that file to resume, choose another folder, or add --overwrite.",
            )
    raise ProblemError(
        where, "the folder holds another sweep", f"Use the {SPEC} in it, or add --overwrite."
    )


def summary(place: Path, where: str) -> dict[str, Any]:
    try:
        record: dict[str, Any] = json.loads((place / SUMMARY).read_text(encoding="utf-8"))
        keys = ("state", "version", "sources", "digest", "spec")
        if isinstance(record, dict) and all(key in record for key in keys):
            return record
    except (ValueError, OSError):
        pass
    raise ProblemError(
        f"{where}, {SUMMARY}", "not part of a sweep", "Choose a sweep's folder, or add --overwrite."
    )


def write_json(path: Path, record: dict[str, Any]) -> None:
    """Write a JSON file, all or nothing."""
    fresh = path.with_name(f".{path.name}.new")
    write_text(fresh, json.dumps(record, indent=2, ensure_ascii=False) + "\n")
    fresh.replace(path)


def drop_journal(place: Path) -> None:
    """Remove the journal, if there still is one; the results contain all of it."""
    shutil.rmtree(place / JOURNAL, ignore_errors=True)


def journals(place: Path) -> list[Path]:
    return sorted((place / JOURNAL).glob(f"*{_journal.SUFFIX}"))


def next_number(folder: Path) -> int:
    used = [int(p.stem) for p in folder.glob(f"*{_journal.SUFFIX}") if p.stem.isdigit()]
    return max(used, default=0) + 1


def spans(paths: Sequence[Path], spec: Spec) -> _journal.Spans:
    pair, columns = np.dtype((np.int64, 2)), len(spec.metrics)
    found = [np.zeros((0, 2), dtype=np.int64)]
    for path in paths:
        if not path.exists():  # a worker may have ended before it made its own
            continue
        places = ((p.first, p.first + p.rows) for p in _journal.scan(path, spec.digest, columns))
        each = np.asarray(np.fromiter(places, dtype=pair), dtype=np.int64)
        found.append(_journal.merged(each.reshape(-1, 2)))
    return _journal.merged(np.concatenate(found))


@contextmanager
def locked(place: Path) -> Iterator[None]:
    """Hold a shared lock on the sweep's folder, as every writer does.

    The system releases it when the process ends.
    """
    file = os.open(place, os.O_RDONLY)
    try:
        fcntl.flock(file, fcntl.LOCK_SH)
        yield
    finally:
        os.close(file)


@contextmanager
def alone(place: Path) -> Iterator[None]:
    """Hold the exclusive lock on the sweep's folder, then a shared one for our workers."""
    where = f"--out {printable(place, 300)}"
    file = os.open(place, os.O_RDONLY)
    try:
        end = time.monotonic() + _PATIENCE
        while not _taken(file, fcntl.LOCK_EX):
            if time.monotonic() > end:
                raise ProblemError(where, _busy(file), ACCEPTED)
            time.sleep(0.1)
        if not _taken(file, fcntl.LOCK_SH):  # another run was quicker
            raise ProblemError(where, _busy(file), ACCEPTED)
        yield
    finally:
        os.close(file)


def _busy(file: int) -> str:
    return f"another sweep or command uses the folder: {holder(file)}"


def _taken(file: int, how: int) -> bool:
    try:
        fcntl.flock(file, how | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
