"""Mutation run: does a test beside a file notice a single wrong sign, term, latch or unit?

    python tools/mutants FILE_OR_FOLDER ... [--sample N] [--seed K] [--jobs N] [--list]

Files are named as in src/macromicro: `rig/guard.py`, `control/live`. Exit status 1 if a file's
tests kill fewer of its mutants than they must or fail without any, 2 for bad input.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Sequence
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import beside
from operators import Mutant, mutants
from running import SURVIVED, Bench, TestsFail

_TOO_MANY = 4000


class Verdict(NamedTuple):
    """A mutant of a file, and what became of it."""

    file: str
    mutant: Mutant
    outcome: str


def sources(names: Sequence[str]) -> list[Path]:
    """The files that are named; raises SystemExit with 2 for one that is not there."""
    found: list[Path] = []
    for name in names:
        path = beside.PACKAGE / name
        files = sorted(path.rglob("*.py")) if path.is_dir() else [path]
        if not files or not files[0].is_file():
            print(f"{name}: no file or folder of src/macromicro", file=sys.stderr)
            raise SystemExit(2)
        found += files
    return list(dict.fromkeys(found))


def chosen(files: Sequence[Path], sample: int | None, seed: int) -> dict[Path, list[Mutant]]:
    """The mutants to try by file, all of them or a random sample of all."""
    everything = [(f, m) for f in files for m in mutants(f.read_text("utf-8"))]
    if sample is not None and sample < len(everything):
        everything = random.Random(seed).sample(everything, sample)
    by_file: dict[Path, list[Mutant]] = {f: [] for f in files}
    for file, mutant in everything:
        by_file[file].append(mutant)
    return {f: sorted(ms, key=lambda m: m.line) for f, ms in by_file.items() if ms}


def tried(work: dict[Path, list[Mutant]], jobs: int) -> tuple[list[Verdict], list[str]]:
    """Every mutant's outcome, and the files whose tests fail without any mutation; survivors
    are printed as they are found."""
    verdicts: list[Verdict] = []
    failing: list[str] = []
    with get_context("fork").Pool(jobs, maxtasksperchild=1) as pool:
        for name, found in pool.imap_unordered(_file, work.items(), chunksize=1):
            if found is None:
                failing.append(name)
            else:
                verdicts += found
    return verdicts, failing


def _file(task: tuple[Path, list[Mutant]]) -> tuple[str, list[Verdict] | None]:
    """One file's mutants, one after the other; None, and what the tests said, if those fail without
    a mutation."""
    source, work = task
    name, tests = beside.name(source), beside.tests(source)
    known = {(e.file, e.before, e.after) for e in beside.equivalents()}
    left = [m for m in work if (name, m.before, m.after) not in known]
    if not tests:
        print(f"{name}: no test beside it, {len(left)} mutants live", flush=True)
        return name, [Verdict(name, m, SURVIVED) for m in left]
    bench = Bench()
    try:
        seconds = bench.baseline(source, tests)
    except TestsFail as error:
        print(f"{error}\n{name}: its tests fail without a mutation", file=sys.stderr, flush=True)
        return name, None
    verdicts = []
    for mutant in left:
        verdicts.append(Verdict(name, mutant, bench.tried(source, mutant, tests, seconds)))
        if verdicts[-1].outcome == SURVIVED:
            listed(name, [mutant])
    killed = sum(verdict.outcome != SURVIVED for verdict in verdicts)
    print(f"{name}: {killed} of {len(left)} killed, {len(work) - len(left)} equivalent; "
          f"tests take {seconds:.1f} s", flush=True)  # fmt: skip
    return name, verdicts


def listed(name: str, found: Sequence[Mutant]) -> None:
    """Print mutants of a file."""
    for m in found:
        print(f"{name}:{m.line}: {m.kind}\n    - {m.before}\n    + {m.after}", flush=True)


def judged(verdicts: Sequence[Verdict], failing: Sequence[str]) -> int:
    """Print what the strict files and the rest reached; the exit status."""
    status = 0
    for name in sorted(failing):
        print(f"{name}: not tried, its tests fail without a mutation")
        status = 1
    for bound in (1.0, 0.9):
        group = [v for v in verdicts if beside.required(v.file) == bound]
        if not group:
            continue
        died = sum(v.outcome != SURVIVED for v in group)
        print(f"{died} of {len(group)} killed ({died / len(group):.1%}), {bound:.0%} asked")
        status = status or int(died < bound * len(group))
    return status


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("files", nargs="+", metavar="FILE", help="inside src/macromicro")
    parser.add_argument("--sample", type=int, help="try this many, drawn from all")
    parser.add_argument("--seed", type=int, default=1, help="of the sample")
    parser.add_argument("--jobs", type=int, default=1, help="files at a time")
    parser.add_argument("--list", action="store_true", help="print the mutants, try none")
    options = parser.parse_args()
    work = chosen(sources(options.files), options.sample, options.seed)
    total = sum(map(len, work.values()))
    if options.list:
        for source, found in work.items():
            listed(beside.name(source), found)
        return 0
    if total > _TOO_MANY:
        print(f"{total} mutants would take hours: name fewer files, or --sample N", file=sys.stderr)
        return 2
    print(f"{total} mutants in {len(work)} files", flush=True)
    return judged(*tried(work, options.jobs))


def _warm() -> None:
    """Import what every test needs, once, before the forks."""
    import h5py
    import hypothesis
    import numba
    import pytest
    import scipy.signal

    assert all((h5py, hypothesis, numba, pytest, scipy.signal))


if __name__ == "__main__":
    _warm()
    sys.exit(main())
