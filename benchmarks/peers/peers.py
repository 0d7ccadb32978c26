"""The peers, each in a process of its own, and the table of them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import environments
import numpy as np
from job import Job, written
from loops import REFERENCE, arguments

from macromicro.models import macro

HERE = Path(__file__).resolve().parent
LONGEST = 600.0  # s, for one peer


class Peer(NamedTuple):
    """Name; its file; its environment ("": this one); the package whose version counts."""

    name: str
    file: str
    environment: str = ""
    package: str = ""


PEERS = (
    Peer(REFERENCE, "peer_c.py"),
    Peer("macromicro", "peer_package.py"),
    Peer("plain Python", "peer_python.py"),
    Peer("FMPy, unit in C", "peer_fmpy.py", "fmpy", "FMPy"),
    Peer("jaxonomy", "peer_jaxonomy.py", "jaxonomy", "jaxonomy"),
    Peer("python-control, one nlsys", "peer_control_single.py", "control", "control"),
    Peer("python-control, interconnect", "peer_control.py", "control", "control"),
    Peer("pathsim", "peer_pathsim.py", "pathsim", "pathsim"),
    Peer("bdsim", "peer_bdsim.py", "bdsim", "bdsim"),
)


class Row(NamedTuple):
    """A peer: times [s] of import, building and first run (cold), of a later run (median and
    least of `runs`), and the processor's time in it (busy, median); largest differences to
    the package's interpreted kernels, samples that differ at all; or why there is nothing.

    Ratios to C: of the least times, and of the processor's. On a busy machine only the
    latter is fair to a long run, which has to wait more often than a short one.
    """

    name: str
    version: str
    cold: float | None = None
    warm: float | None = None
    least: float | None = None
    busy: float | None = None
    runs: int = 0
    ratio_of_least: float | None = None
    ratio_of_busy: float | None = None
    counts_off: float | None = None
    volts_off: float | None = None
    differing: int | None = None
    failed: str = ""


def expected(job: Job) -> np.ndarray:
    """Counts and effort by row, from the package's kernels without the compiler."""
    out = np.empty((2, job.samples))
    macro.rollout(*arguments(job), out)
    return out


def measure(job: Job, folder: Path, wanted: list[str]) -> list[Row]:
    """All peers, or those whose name has one of the words `wanted` and the reference."""
    place, right = written(job, folder / "job.json"), expected(job)
    rows: list[Row] = []
    for peer in PEERS:
        if wanted and not any(word.lower() in peer.name.lower() for word in (*wanted, REFERENCE)):
            continue
        rows.append(beside(rows, one(peer, place, folder, right)))
    return rows


def beside(rows: list[Row], row: Row) -> Row:
    """The row with its ratios to the reference among `rows`, or to itself."""
    for c in (*rows, row):
        if c.name == REFERENCE and c.least and c.busy and row.least and row.busy:
            return row._replace(ratio_of_least=row.least / c.least, ratio_of_busy=row.busy / c.busy)
    return row


def one(peer: Peer, place: Path, folder: Path, right: np.ndarray) -> Row:
    """One peer, or why not."""
    version = environments.version(peer.environment, peer.package) if peer.environment else ""
    out, times = folder / f"{peer.file}.npy", folder / f"{peer.file}.json"
    try:
        python = environments.python(peer.environment) if peer.environment else sys.executable
        print(f"running {peer.name}", file=sys.stderr, flush=True)
        done = subprocess.run(
            [str(python), str(HERE / peer.file), str(place), str(out), str(times)],
            capture_output=True, text=True, timeout=LONGEST, check=False, cwd=folder,
        )  # fmt: skip
    except environments.NoEnvironmentError as problem:
        return Row(peer.name, version, failed=f"not installed: {problem}")
    except subprocess.TimeoutExpired:
        return Row(peer.name, version, failed=f"took more than {LONGEST:.0f} s")
    if done.returncode != 0:
        words = [w.strip() for w in done.stderr.splitlines() if w.strip()]
        return Row(peer.name, version, failed=words[-1] if words else f"exit {done.returncode}")
    found, took = np.load(out), json.loads(times.read_text(encoding="utf-8"))
    row = Row(peer.name, version, took["cold"], took["warm"], took["least"])
    row = row._replace(busy=took["busy"], runs=took["runs"])
    if found.shape != right.shape:
        return row._replace(failed=f"trajectory of shape {found.shape}, not {right.shape}")
    off = np.abs(found - right)
    return row._replace(
        counts_off=float(off[0].max()),
        volts_off=float(off[1].max()),
        differing=int((off > 0.0).any(axis=0).sum()),
    )


def show(rows: list[Row]) -> None:
    """The table."""
    head = f"{'peer':30}{'version':>8}{'cold':>9}{'warm':>12}{'least':>12}{'busy':>12}"
    print(f"\n{head}{'busy to C':>11}{'counts off':>12}{'volts off':>11}")
    for row in rows:
        start = f"{row.name:30}{row.version:>8}"
        if row.cold is None or row.warm is None or row.least is None or row.busy is None:
            print(f"{start}   {row.failed}")
            continue
        ratio = "-" if row.ratio_of_busy is None else f"{row.ratio_of_busy:.3g}"
        times = "".join(f"{1e3 * s:9.3f} ms" for s in (row.warm, row.least, row.busy))
        start += f"{row.cold:7.2f} s{times}{ratio:>11}"
        if row.counts_off is None or row.volts_off is None:
            print(f"{start}   {row.failed}")
            continue
        print(f"{start}{row.counts_off:12g}{row.volts_off:11.2g}")
