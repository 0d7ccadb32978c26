"""The laboratory procedures of `macromicro collect`, and those of the user's.

A procedure takes a lab and returns recordings by file name; the runs of one file are
distinguished by the column `run`. One of your own is named "module:procedure".
"""

from __future__ import annotations

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


def joined(
    runs: Sequence[Recording], attributes: Mapping[str, Attribute] | None = None
) -> Recording:
    """Recordings of the same columns and sample time as one, with the column `run`."""
    columns = (*runs[0].columns, RUN)
    shown = [c for c in columns if c is RUN or not c.name.startswith("true_")]
    arrays = [np.concatenate([r[c.name] for r in runs]) for c in shown if c is not RUN]
    which = np.repeat(np.arange(1, len(runs) + 1), [len(r) for r in runs])
    return Recording.from_arrays(shown, [*arrays, which], runs[0].dt, dict(attributes or {}))


def _dead_zone(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter4 import _friction_runs as friction

    low, high = friction.TRAVEL
    ends: dict[str, Attribute] = {"travel_low": low, "travel_high": high, **_about(lab)}
    return {"dead-zone": joined(friction.collect(lab.bench()), ends)}


def _macro_steps(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter4 import _identification_runs

    found = _identification_runs.collect(lab.bench(), lab.seed)
    return {f"steps-{volts:g}V": joined(runs, _about(lab)) for volts, runs in found.items()}


def _drive(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter4 import _friction_runs

    about = _about(lab)
    if not lab.rigs:
        about["delay"] = 1  # the twin's D/A board latches a voltage one period late
    return {"drive": joined([_friction_runs.pulsed(lab.bench())], about)}


def _carriage(lab: Lab) -> Recordings:
    from macromicro.thesis import strokes

    bench = lab.bench()
    volts = np.concatenate([strokes.efforts(_FULL), strokes.nudges(_FULL)])
    runs = [
        strokes.stroked(bench, volts, start, lab.seed + k) for k, start in enumerate(_STROKES_FROM)
    ]
    return {"carriage": joined(runs, _about(lab))}


def _kiln(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter5 import kiln_runs

    found = kiln_runs.collect(lab.kiln(), lab.seed)
    tests = {f"test-{k}": run for k, run in enumerate(found.tests, 1)}
    return {
        name: joined([run], _about(lab)) for name, run in {"cycles": found.curves, **tests}.items()
    }


def _electrothermal(lab: Lab) -> Recordings:
    from macromicro.thesis.chapter5 import _electrothermal_runs

    found = _electrothermal_runs.collect(lab.bench(), lab.seed)
    made = {f"step-{v:g}V": joined(runs, _about(lab)) for v, runs in found.steps.items()}
    return made | {f"cooling-{v:g}V": joined(r, _about(lab)) for v, r in found.cooled.items()}


def _actuator(lab: Lab) -> Recordings:
    from macromicro.thesis import heats

    runs = list(heats.records(lab.bench(), lab.seed))
    quick = min(r.dt for r in runs)
    return {
        name: joined([r for r in runs if (r.dt == quick) == (name == "quick")], _about(lab))
        for name in ("held", "quick")
    }


def _hall(lab: Lab) -> Recordings:
    from macromicro import hall_table
    from macromicro.recorded import named
    from macromicro.thesis import hall_ramps

    columns = named("t", "hall_voltage", "laser")
    runs = [
        Recording.from_arrays(
            columns, [np.arange(len(v)) * hall_table.DT, v, x * 1e6], hall_table.DT, {}
        )
        for v, x in hall_ramps.collect(lab.bench(), lab.seed)
    ]
    return {"hall": joined(runs, _about(lab))}


def _about(lab: Lab) -> dict[str, Attribute]:
    named = {r.kind: r.name for r in lab.rigs}
    return {"seed": lab.seed, **named}


PROCEDURES = (
    Procedure(
        "dead-zone",
        _dead_zone,
        ("encoder",),
        "the carriage alone, 18 min",
        "420 runs at 2.6 to 3.3 V from 14 places, both ways",
        "macromicro identify deadzone {out}/dead-zone.h5",
        40,
    ),
    Procedure(
        "macro-steps",
        _macro_steps,
        ("encoder",),
        "the carriage alone, 1 min",
        "10 steps each, 0.1, 1 and 2 V beyond the dead zone of 3 V",
        "macromicro identify linear {out}/steps-1V.h5 --width 3",
        5,
    ),
    Procedure(
        "drive",
        _drive,
        ("encoder",),
        "the carriage alone, 7 s",
        "pulses of 3.3 to 5 V, both ways",
        "macromicro identify drive {out}/drive.h5 --structure coulomb",
        5,
    ),
    Procedure(
        "carriage",
        _carriage,
        ("encoder", "laser"),
        "the carriage, and the laser on the platform, 1 min",
        "strokes of 3 to 250 ms at 3.3 to 5 V, both ways, from two places, and nudges of 0.25 V",
        "macromicro identify carriage {out}/carriage.h5",
        5,
    ),
    Procedure(
        "kiln",
        _kiln,
        ("kiln.thermocouple", "kiln.encoder"),
        "the actuator in the kiln, half a day",
        "heating cycles with falling maxima, and three profiles to test the table",
        "macromicro identify hysteresis {out}/cycles.h5 --shape nonnegative --out KILN",
        40,
    ),
    Procedure(
        "electrothermal",
        _electrothermal,
        ("laser",),
        "the micro-stage alone, 1.2 h, and the table from the kiln",
        "steps of CTRL from cold, three trials each, and steps with cooling",
        "macromicro identify thermal {out}/*.h5 --table KILN/table.h5",
        60,
    ),
    Procedure(
        "actuator",
        _actuator,
        ("laser", "hall"),
        "the micro-stage alone, half an hour, and the table from the kiln",
        "levels held, steps that cool again, minor loops, and bursts of full heat",
        "macromicro identify actuator {out}/*.h5 --table KILN/table.h5",
        60,
    ),
    Procedure(
        "hall",
        _hall,
        ("hall", "laser"),
        "the micro-stage and the laser, 6 min",
        "slow ramps of CTRL, three up and three down",
        "macromicro identify hall {out}/hall.h5",
        20,
    ),
)


def find(name: str) -> Procedure:
    for procedure in PROCEDURES:
        if procedure.name == name:
            return procedure
    names = tuple(procedure.name for procedure in PROCEDURES)
    group = plugins.Group(GROUP, "a procedure", Procedure, FORM, names)
    found: Procedure = group.find(name, "experiment")
    return found


def checked(found: Any, name: str) -> Recordings:
    where, remedy = f"procedure {printable(name)}", "Give one recording or more, by file name."
    if not isinstance(found, dict) or not found:
        raise ProblemError(where, f"it gave {printable(found)}", remedy)
    for file, recording in found.items():
        plain = isinstance(file, str) and file == Path(file).name and file not in ("", ".", "..")
        if not plain or not isinstance(recording, Recording):
            raise ProblemError(where, f"{printable(file)} is {type(recording).__name__}", remedy)
    return found
