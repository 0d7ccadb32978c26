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
import running
import swift
from operators import Mutant, mutants

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


def tried(work: dict[Path, list[Mutant]], jobs: int, once: bool) -> tuple[list[Verdict], list[str]]:
    """Every mutant's outcome, and the files whose tests fail without any mutation; survivors
    are printed as each file is done."""
    known = {(e.file, e.before, e.after) for e in beside.equivalents()}
    tasks = [(source, found, known, once) for source, found in work.items()]
    verdicts: list[Verdict] = []
    failing: list[str] = []
    with get_context("fork").Pool(jobs, maxtasksperchild=1) as pool:
        for source, found in pool.imap_unordered(_file, tasks, chunksize=1):
            if found is None:
                failing.append(beside.name(source))
            else:
                verdicts += found
    return verdicts, failing


_Task = tuple[Path, list[Mutant], set[tuple[str, str, str]], bool]


def _file(task: _Task) -> tuple[Path, list[Verdict] | None]:
    """One file's mutants; None, and what the tests said, if those fail without a mutation."""
    try:
        return task[0], _outcomes(*task)
    except running.TestsFail as error:
        print(error, file=sys.stderr, flush=True)
        return task[0], None


def _outcomes(
    source: Path, work: list[Mutant], known: set[tuple[str, str, str]], once: bool
) -> list[Verdict]:
    """One file's mutants, one after the other."""
    name, tests = beside.name(source), beside.tests(source)
    left = [m for m in work if (name, m.before, m.after) not in known]
    if not tests:
        print(f"{name}: no test beside it, {len(left)} mutants live", flush=True)
        return [Verdict(name, m, running.SURVIVED) for m in left]
    text = source.read_text("utf-8")
    quick = [m for m in left if swift.fitting(text, m)]
    seconds, found = swift.outcomes(source, quick, tests)
    outcomes = dict(zip(quick, found, strict=True))
    again = [m for m in left if m not in outcomes]
    if not once:
        again += [m for m in quick if outcomes[m] == running.SURVIVED]
    if again:
        outcomes |= _slowly(source, again, tests, seconds)
    verdicts = [Verdict(name, m, outcomes[m]) for m in left]
    for _, mutant, outcome in verdicts:
        if outcome == running.SURVIVED:
            print(f"{name}:{mutant.line}: {mutant.kind}", flush=True)
            print(f"    - {mutant.before}\n    + {mutant.after}", flush=True)
    died = sum(v.outcome != running.SURVIVED for v in verdicts)
    print(f"{name}: {died} of {len(verdicts)} killed, {len(work) - len(left)} equivalent; "
          f"tests take {seconds:.1f} s", flush=True)  # fmt: skip
    return verdicts


def _slowly(
    source: Path, work: list[Mutant], tests: list[Path], seconds: float
) -> dict[Mutant, str]:
    """The same, everything imported anew for each."""
    bench = running.Bench()
    try:
        if not running.baseline(bench, source, tests).passed:
            raise running.TestsFail(beside.name(source), bench.output())
        limit = running.allowed(seconds)
        text = source.read_text("utf-8")
        return {
            m: bench.run(source, m.text, tests, limit, fresh=swift.new_machine_code(text, m))
            for m in work
        }
    finally:
        bench.close()


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
        died = sum(v.outcome != running.SURVIVED for v in group)
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
    parser.add_argument("--once", action="store_true", help="try no survivor a second time")
    options = parser.parse_args()
    work = chosen(sources(options.files), options.sample, options.seed)
    total = sum(map(len, work.values()))
    if options.list:
        for source, found in work.items():
            for m in found:
                print(
                    f"{beside.name(source)}:{m.line}: {m.kind}\n    - {m.before}\n    + {m.after}"
                )
        return 0
    if total > _TOO_MANY:
        print(f"{total} mutants would take hours: name fewer files, or --sample N", file=sys.stderr)
        return 2
    print(f"{total} mutants in {len(work)} files", flush=True)
    return judged(*tried(work, options.jobs, options.once))


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
