"""Columns recorded each control period."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Column, Quantity, layout, put
from macromicro.control import macro, micro, outside
from macromicro.control.supervisor import FAULT, Progress, Supervisor
from macromicro.kernel import kernel
from macromicro.plant.bench import Truth
from macromicro.rig.codes import OK
from macromicro.rig.guard import Watch
from macromicro.types import Command, Outputs, Sample


class Inside(NamedTuple):
    """State of controller and guard for the recording."""

    macro_integral: Annotated[float, Quantity("V", "integral effort of the macro controller")]
    micro_integral: Annotated[float, Quantity("V", "integral effort of the micro controller")]
    temperature_estimate: Annotated[
        float, Quantity("degC", "wire temperature estimated from CTRL by the guard")
    ]
    phase: Annotated[
        float, Quantity("1", "0 waiting 1 macro 2 settling 3 micro 4 done 5 fault", "i1")
    ]
    move: Annotated[float, Quantity("1", "index of the present move, -1 before the first", "i4")]


COLUMNS, (_SAMPLE, _COMMAND, _OUTPUTS, _INSIDE, _TRUTH) = layout(
    Sample, Command, Outputs, Inside, Truth
)
ROWS = len(COLUMNS)
NAMES = tuple(c.name for c in COLUMNS)


def columns_named(*names: str) -> tuple[Column, ...]:
    known = {column.name: column for column in COLUMNS}
    return tuple(known[name] for name in names)


def columns(control: Supervisor) -> tuple[Column, ...]:
    own = outside.columns(control.macro.gains[macro.SHIPPED :])
    return (*COLUMNS, *own, *micro.columns(control.fine))


@kernel
def beside(out: Array, k: int, control: Supervisor, progress: Progress) -> None:
    """Write the memories of laws by the contract into a block."""
    own = progress.macro[macro.SHIPPED :]
    outside.note(out, k, own, ROWS)
    micro.note(out, k, control.fine, progress.fine, ROWS + outside.rows(own))


@kernel
def inside(progress: Progress, watch: Watch, temperature: float) -> Inside:
    return Inside(
        macro.integral(progress.macro),
        progress.integral,
        temperature,
        float(progress.phase if watch.fault == OK else FAULT),
        float(progress.move),
    )


@kernel
def note(
    out: Array,
    k: int,
    sample: Sample,
    command: Command,
    given: Outputs,
    shown: Inside,
    real: Truth,
) -> None:
    put(out, k, sample, _SAMPLE.rows, _SAMPLE.scales)
    put(out, k, command, _COMMAND.rows, _COMMAND.scales)
    put(out, k, given, _OUTPUTS.rows, _OUTPUTS.scales)
    put(out, k, shown, _INSIDE.rows, _INSIDE.scales)
    put(out, k, real, _TRUTH.rows, _TRUTH.scales)
