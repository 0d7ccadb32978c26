"""Results of a run as figures, for tuning and robustness."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Annotated, Any, NamedTuple

import numpy as np

from macromicro.batch.variants import Metric
from macromicro.columns import Quantity, layout
from macromicro.machines import composite, planning, results
from macromicro.machines.composite import AnyMachine
from macromicro.machines.machine import Machine
from macromicro.machines.planning import Planned
from macromicro.place import LENGTH
from macromicro.recording import Recording
from macromicro.schema.par import NO_UNIT


class Trial(NamedTuple):
    """Results of a run in um (mdeg if rotary); infinity: no arrival; NaN: stopped by the guard."""

    fault: Annotated[float, Quantity("1", "code of the fault that stopped the run, 0 for none")]
    missed: Annotated[float, Quantity("1", "moves that did not arrive")]
    settling: Annotated[float, Quantity("s", "slowest arrival, from the end of the profile")]
    mean_settling: Annotated[float, Quantity("s", "mean arrival, from the end of the profile")]
    peak_error: Annotated[
        float, Quantity("um", "largest distance from the set point during the moves")
    ]
    rms_error: Annotated[float, Quantity("um", "rms distance from the set point during the moves")]
    overshoot: Annotated[float, Quantity("um", "largest overshoot past a target")]
    rest_error: Annotated[float, Quantity("um", "largest error at rest, by the encoder")]
    true_error: Annotated[float, Quantity("um", "largest error at rest, true")]
    effort: Annotated[float, Quantity("V", "largest effort")]
    rough: Annotated[float, Quantity("V", "rms change of the effort from period to period")]


_SHARED = {
    "fault": Quantity("1", "code of the fault that stopped the run, 0 for none"),
    "missed": Quantity("1", "moves that did not arrive"),
}
_PATH = {
    "contour": Quantity("um", "largest distance from the path, by the encoders"),
    "rms_contour": Quantity("um", "rms distance from the path, by the encoders"),
    "true_contour": Quantity("um", "largest distance from the path, true"),
}
_TRUE = Quantity("um", "largest distance from the target at rest, true")


def kind(machine: AnyMachine) -> Any:
    """The ``NamedTuple`` of a machine's figures: `Trial`, or one with those of each stage."""
    if isinstance(machine, Machine):
        return Trial
    return _joint(composite.names(machine), composite.places(machine), machine.has_plane)


@lru_cache(maxsize=16)
def _joint(names: tuple[str, ...], places: tuple[Any, ...], has_plane: bool) -> Any:
    """Figures of several stages; infinity: no arrival; NaN: stopped by a guard."""
    notes = _SHARED | (_PATH if has_plane else {})
    all_stages = "both" if len(names) == 2 else "all"
    slowest = f"slowest arrival of {all_stages}, from the end of the profile"
    notes["settling"] = Quantity("s", slowest)
    for name, place in zip(names, places, strict=True):
        words = f"largest distance from the set point, {name}"
        notes[f"peak_error_{name}"] = place.column(Quantity("um", words))
    if has_plane:
        notes["true_error"] = _TRUE
    for name in names:
        words = f"rms change of the effort from period to period, {name}"
        notes[f"rough_{name}"] = Quantity("V", words)
    fields = [(name, Annotated[float, note]) for name, note in notes.items()]
    return NamedTuple("JointTrial", fields)


def metrics(machine: AnyMachine) -> tuple[Metric, ...]:
    """The figures of a run, with their units."""
    place = machine.stages[0][1].kind.place if isinstance(machine, Machine) else LENGTH
    return tuple(
        Metric(c.name, "" if c.unit in NO_UNIT else c.unit, c.meaning)
        for c in layout(kind(machine), place=place).columns
    )


def figures_of(
    machine: AnyMachine, settings: Any, planned: Planned, recording: Recording, fault: int
) -> Any:
    """Figures of a run that a fault, by its code, or 0 ended."""
    moves = results.of(machine, recording, planned, settings)
    planned_moves = len(planning.each(planned)[0].target)
    whole = fault == 0 and len(moves) == planned_moves
    settling = results.settling(moves)

    def most(values: Iterable[float | None]) -> float:
        known = [abs(v) for v in values if v is not None]
        return 1e3 * max(known, default=0.0) if whole else math.nan

    def rms(values: list[float]) -> float:
        squares = [v**2 for v in values]
        return 1e3 * math.sqrt(float(np.mean(squares))) if whole and squares else math.nan

    shared = {
        "fault": float(fault),
        "missed": float(planned_moves - results.count_arrived(moves)),
        "settling": max(0.0, *settling) if whole else math.nan,
    }
    if isinstance(machine, Machine):
        return Trial(
            **shared,
            mean_settling=max(0.0, float(np.mean(settling))) if whole else math.nan,
            peak_error=most(m.peak_error for m in moves),
            rms_error=rms([m.rms_error for m in moves]),
            overshoot=most(m.overshoot for m in moves),
            rest_error=most(m.rest_error for m in moves),
            true_error=most(m.true_error for m in moves),
            effort=float(np.max(np.abs(recording["effort"]))),
            rough=_rough(recording, "effort"),
        )
    paths = [m.contour for m in moves if m.contour is not None]
    found = shared | {
        "contour": most(c.peak for c in paths),
        "rms_contour": rms([c.rms for c in paths]),
        "true_contour": most(c.true_peak for c in paths),
        "true_error": most(m.true_error for m in moves),
    }
    for k, name in enumerate(composite.names(machine)):
        found[f"peak_error_{name}"] = most(m.axes[k].peak_error for m in moves)
        found[f"rough_{name}"] = _rough(recording, f"{name}_effort")
    made = kind(machine)
    return made(**{name: found[name] for name in made._fields})


def _rough(recording: Recording, column: str) -> float:
    """RMS change of an effort from period to period, V."""
    if len(recording) < 2:
        return 0.0
    return float(np.sqrt(np.mean(np.diff(recording[column]) ** 2)))
