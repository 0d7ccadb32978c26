"""The laboratory procedures of `macromicro collect`, and those of the user's.

A procedure takes a lab and returns recordings by file name; the runs of one file are
distinguished by the column `run`. One of your own is named "module:procedure".
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from macromicro.columns import Column
from macromicro.errors import ProblemError
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.schema import plugins
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from macromicro.thesis.procedure import Lab

Recordings = dict[str, Recording]
GROUP = "macromicro.procedures"
FORM = "MODULE:PROCEDURE, one of your own (docs/own-machines.md)"
_FULL = 5.0  # V
_STROKES_FROM = (700.0, 1120.0)  # counts
RUN = Column("run", "1", "number of the row's run, from 1", "i2")


class Procedure(NamedTuple):
    name: str  # of it, and of the folder of its recordings
    collect: Callable[[Lab], Recordings]  # runs it, and gives recordings by file name
    channels: tuple[str, ...]  # what the rig must measure, as those of `thesis.procedure.Procedure`
    needs: str  # of the rig and of time, for people
    gives: str  # what is recorded, for people
    then: str = ""  # what to do with the files; {out} is their folder. "": nothing is said
    megabytes: int = 50  # at most, on the disk


def join(runs: Sequence[Recording], attributes: Mapping[str, Attribute] | None = None) -> Recording:
    """Recordings of the same columns and sample time as one, with the column `run`."""
    columns = (*runs[0].columns, RUN)
    shown = [c for c in columns if c is RUN or not c.name.startswith("true_")]
    arrays = [np.concatenate([r[c.name] for r in runs]) for c in shown if c is not RUN]
    which = np.repeat(np.arange(1, len(runs) + 1), [len(r) for r in runs])
    return Recording.from_arrays(shown, [*arrays, which], runs[0].dt, dict(attributes or {}))


def _dead_zone(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter4 import friction

    low, high = friction.TRAVEL
    ends: dict[str, Attribute] = {"travel_low": low, "travel_high": high, **_about(lab)}
    return {"dead-zone": join(friction.probing_runs(lab.bench()), ends)}


def _macro_steps(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter4 import identification

    found = identification.step_runs(lab.bench(), lab.seed)
    return {f"steps-{volts:g}V": join(runs, _about(lab)) for volts, runs in found.items()}


def _drive(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter4 import friction

    about = _about(lab)
    if not lab.rigs:
        about["delay"] = 1  # the twin's D/A board latches a voltage one period late
    return {"drive": join([friction.pulse(lab.bench())], about)}


def _carriage(lab: Lab) -> Recordings:
    from macromicro.thesis import strokes

    bench = lab.bench()
    volts = np.concatenate([strokes.efforts(_FULL), strokes.nudges(_FULL)])
    runs = [
        strokes.stroke(bench, volts, start, lab.seed + k) for k, start in enumerate(_STROKES_FROM)
    ]
    return {"carriage": join(runs, _about(lab))}


def _kiln(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter5 import kiln_runs

    found = kiln_runs.collect(lab.kiln(), lab.seed)
    tests = {f"test-{k}": run for k, run in enumerate(found.tests, 1)}
    return {
        name: join([run], _about(lab)) for name, run in {"cycles": found.curves, **tests}.items()
    }


def _electrothermal(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter5 import electrothermal_runs

    found = electrothermal_runs.collect(lab.bench(), lab.seed)
    made = {f"step-{v:g}V": join(runs, _about(lab)) for v, runs in found.steps.items()}
    return made | {f"cooling-{v:g}V": join(r, _about(lab)) for v, r in found.cooled.items()}


def _actuator(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter5 import electrothermal_runs

    runs = electrothermal_runs.for_actuator(lab.bench(), lab.seed)
    quick = min(r.dt for r in runs)
    return {
        name: join([r for r in runs if (r.dt == quick) == (name == "quick")], _about(lab))
        for name in ("held", "quick")
    }


def _hall(lab: Lab) -> Recordings:
    from macromicro import hall_table
    from macromicro.recorded import columns_named
    from macromicro.thesis.chapter3 import hall_calibration

    columns = columns_named("t", "hall_voltage", "laser")
    runs = [
        Recording.from_arrays(
            columns, [np.arange(len(v)) * hall_table.DT, v, x * 1e6], hall_table.DT, {}
        )
        for v, x in hall_calibration.ramps(lab.bench(), lab.seed)
    ]
    return {"hall": join(runs, _about(lab))}


def _about(lab: Lab) -> dict[str, Attribute]:
    named = {r.kind: r.name for r in lab.rigs}
    return {"seed": lab.seed, **named}


_COLLECT: dict[str, Callable[[Lab], Recordings]] = {
    "dead-zone": _dead_zone,
    "macro-steps": _macro_steps,
    "drive": _drive,
    "carriage": _carriage,
    "kiln": _kiln,
    "electrothermal": _electrothermal,
    "actuator": _actuator,
    "hall": _hall,
}
_LIST = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
PROCEDURES = tuple(
    Procedure(name, _COLLECT[name], **{**row, "channels": tuple(row["channels"])})
    for name, row in _LIST.items()
)


def find(name: str) -> Procedure:
    for procedure in PROCEDURES:
        if procedure.name == name:
            return procedure
    names = tuple(procedure.name for procedure in PROCEDURES)
    group = plugins.Group(GROUP, "a procedure", Procedure, FORM, names)
    found: Procedure = group.find(name, "experiment")
    return found


def check(found: Any, name: str) -> Recordings:
    where, remedy = f"procedure {printable(name)}", "Give one recording or more, by file name."
    if not isinstance(found, dict) or not found:
        raise ProblemError(where, f"it gave {printable(found)}", remedy)
    for file, recording in found.items():
        plain = isinstance(file, str) and file == Path(file).name and file not in ("", ".", "..")
        if not plain or not isinstance(recording, Recording):
            raise ProblemError(where, f"{printable(file)} is {type(recording).__name__}", remedy)
    return found
