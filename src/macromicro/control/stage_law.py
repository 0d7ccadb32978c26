"""What a control law of one stage is: in metres, of any control period, with derivatives ahead."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Annotated, Any, NamedTuple

from macromicro.arrays import Array
from macromicro.columns import Quantity
from macromicro.kernel import kernel


class Sample(NamedTuple):
    """What a stage shows at one instant; NaN: no new value."""

    t: Annotated[float, Quantity("s", "time since the start")]
    position: Annotated[float, Quantity("mm", "measured position", scale=1e3)]


class Target(NamedTuple):
    """Where a stage is to be just now, and how that changes.

    `turn` is a preview, in s: until the set point of a trajectory next turns back; infinite where
    it does not, or where nobody knows.
    """

    position: Annotated[float, Quantity("mm", "set point", column="target", scale=1e3)]
    velocity: Annotated[
        float, Quantity("mm/s", "speed of the set point", column="target_speed", scale=1e3)
    ]
    acceleration: Annotated[
        float, Quantity("m/s^2", "acceleration of the set point", column="target_acceleration")
    ]
    turn: float = math.inf


@kernel
def itself(memory: Any) -> Any:
    """All of the memory.

    Parameters
    ----------
    memory : Any
        Of a law.

    Returns
    -------
    Any
        The same.

    Examples
    --------
    >>> from macromicro.control.stage_law import itself
    >>> itself((0.1, 0.2))
    (0.1, 0.2)
    """
    return memory


class StageLaw(NamedTuple):
    """A law of one stage. `start` and `step` are kernels, valid for any control period.

    Examples
    --------
    >>> from macromicro.control import stage_pi
    >>> from macromicro.control.stage_law import Sample, StageLaw, Target
    >>> law = StageLaw("mine", stage_pi.StagePi, stage_pi.Memory, stage_pi.start, stage_pi.step)
    >>> gains, sample, target = law.gains(), Sample(0.0, 0.0), Target(1e-4, 0.0, 0.0)  # m
    >>> memory, effort = law.step(gains, law.start(gains, sample), target, sample, 0.001)
    >>> round(effort, 3)  # V
    0.3
    """

    name: str  #: for people
    gains: Any  #: A ``NamedTuple`` of floats with defaults, annotated with `Par`
    #: what the law remembers, or what `tell` shows of it: a ``NamedTuple`` of floats; what is
    #: annotated with a `Quantity` is recorded
    memory: Any
    start: Callable[[Any, Sample], Any]  #: from gains and the first sample to the memory
    #: from gains, memory, target, sample and period (s) to a new memory and an effort (V at the
    #: D/A)
    step: Callable[[Any, Any, Target, Sample, float], tuple[Any, float]]
    #: kernel: from the memory to what is recorded of it. Only a law whose memory holds more than
    #: floats needs its own; its `start` need not be a kernel
    tell: Callable[[Any], Any] = itself
    #: "m", or "count" for a law of the macro-stage in its encoder's counts: of positions, their
    #: derivatives included
    unit: str = "m"
    compensated: bool = True  #: whether the macro-stage's dead-zone inverse is on "as designed"
    #: kernel, where a move of the macro-stage follows a rest: from gains, memory and sample to a
    #: memory that keeps what was learned. None: `start` begins again
    again: Callable[[Any, Any, Sample], Any] | None = None
    #: from gains to what `start`, `step` and `rest` take instead of them, such as tables
    prepare: Callable[[Any], Any] | None = None
    params: Any = None  #: of what `prepare` gives: a ``NamedTuple``
    #: kernel, of a law of the micro-stage whose model runs on while it has no turn: from gains,
    #: memory, sample and period (s) to a new memory, the effort having been 0. Such a law begins
    #: once, with the run; its `start` need not be a kernel
    rest: Callable[[Any, Any, Sample, float], Any] | None = None
    #: what a run has taught, no kernel: from gains and what was recorded of the memory, by column
    #: names without their prefix, to the gains that a next run should begin with
    kept: Callable[[Any, Mapping[str, Array]], Any] | None = None
    #: the stage of the two-stage machine whose model the gains are, "macro" or "micro": no other
    #: stage runs under the law. "": none, and any stage of its unit does
    model_of: str = ""
