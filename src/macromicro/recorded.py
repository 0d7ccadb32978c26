"""What a run records each control period: the columns follow from the types behind them."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Column, Quantity, layout, put
from macromicro.control import macro, micro, outside
from macromicro.control.supervisor import FAULT, Progress, Supervisor
from macromicro.kernel import kernel
from macromicro.plant.bench import Truth
from macromicro.rig import guard
from macromicro.rig.codes import OK
from macromicro.rig.guard import Watch
from macromicro.types import Command, Outputs, Sample


class Inside(NamedTuple):
    """What controller and guard know beside what they ask for."""

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


def named(*names: str) -> tuple[Column, ...]:
    """Some of `COLUMNS`.

    Parameters
    ----------
    *names : str
        Names of columns.

    Returns
    -------
    tuple[Column, ...]
        In the order of `names`.

    Raises
    ------
    KeyError
        There is no such column.
    """
    known = {column.name: column for column in COLUMNS}
    return tuple(known[name] for name in names)


def columns(control: Supervisor) -> tuple[Column, ...]:
    """What a run records each control period under its laws.

    Parameters
    ----------
    control : Supervisor
        Of the run.

    Returns
    -------
    tuple[Column, ...]
        `COLUMNS`, and what laws by the contract have recorded of their memories.
    """
    own = outside.columns(control.macro.gains[macro.SHIPPED :])
    return (*COLUMNS, *own, *micro.columns(control.fine))


@kernel
def beside(out: Array, k: int, control: Supervisor, progress: Progress) -> None:
    """Write what laws by the contract remember into a block.

    Parameters
    ----------
    out : ndarray, shape (rows, periods)
        The block; rows as of `columns`.
    k : int
        Column of the block.
    control : Supervisor
        Of the run.
    progress : Progress
        The supervisor's state.
    """
    own = progress.macro[macro.SHIPPED :]
    outside.note(out, k, own, ROWS)
    micro.note(out, k, control.fine, progress.fine, ROWS + outside.rows(own))


@kernel
def inside(progress: Progress, watch: Watch) -> Inside:
    """What is recorded of a controller and a guard.

    Parameters
    ----------
    progress : Progress
        The supervisor's state.
    watch : Watch
        The guard's state.

    Returns
    -------
    Inside
        In the units of its fields.
    """
    return Inside(
        macro.integral(progress.macro),
        progress.integral,
        guard.temperature(watch),
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
    """Write one control period into a block.

    Parameters
    ----------
    out : ndarray, shape (ROWS, periods)
        The block; rows as in `COLUMNS`.
    k : int
        Column of the block.
    sample : Sample
        What the rig showed.
    command : Command
        What the controller asked for.
    given : Outputs
        The outputs as the guard let them through.
    shown : Inside
        What controller and guard know beside.
    real : Truth
        What only the bench knows, SI; NaN on a real rig.
    """
    put(out, k, sample, _SAMPLE.rows, _SAMPLE.scales)
    put(out, k, command, _COMMAND.rows, _COMMAND.scales)
    put(out, k, given, _OUTPUTS.rows, _OUTPUTS.scales)
    put(out, k, shown, _INSIDE.rows, _INSIDE.scales)
    put(out, k, real, _TRUTH.rows, _TRUTH.scales)
