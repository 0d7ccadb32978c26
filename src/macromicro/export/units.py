"""What a unit of export is: functions under one name, with their parameters and state."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from macromicro.control import outside
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.kernel import is_kernel


class Entry(NamedTuple):
    """A function that the user of the exported code calls.

    Attributes
    ----------
    name : str
        In C, behind the unit's.
    function : Callable
        The kernel.
    arguments : tuple[Any, ...]
        An example of each, or its type.
    when : str
        Its occasion, for what is called instead of the others and not in each period; "" otherwise.
    """

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    when: str = ""


class Unit(NamedTuple):
    """What is exported under one name.

    Attributes
    ----------
    name : str
        Of it.
    title : str
        For people.
    entries : tuple[Entry, ...]
        What is called, in the order of a period.
    given : dict[str, Any]
        Parameters and tables that are written into the code.
    state : Any
        At the start; None for what has none, or makes it in a function of its own.
    period : float
        Control period for the example, s.
    memory : tuple[str, ...]
        Numbers that a function takes and returns anew, where no state holds them.
    """

    name: str
    title: str
    entries: tuple[Entry, ...]
    given: dict[str, Any]
    state: Any = None
    period: float = 1e-3
    memory: tuple[str, ...] = ()


Made = dict[str, Callable[[], Unit]]


def law_of(name: str, law: StageLaw, gains: Any, period: float) -> Unit:
    """A law of one stage, with its gains."""
    sample, target = Sample(0.0, 0.0), Target(0.0, 0.0, 0.0, math.inf)
    gains = outside.given(law, gains)
    memory = law.start(gains, sample)
    entries = [Entry("step", law.step, (gains, memory, target, sample, 0.0))]
    state = memory
    if is_kernel(law.start):
        entries.insert(0, Entry("start", law.start, (gains, sample)))
        state = None
    if law.again is not None:
        when = "where a move follows a rest, instead of `start`"
        entries.append(Entry("again", law.again, (gains, memory, sample), when))
    if law.rest is not None:
        when = "in a period without effort, instead of `step`"
        entries.append(Entry("rest", law.rest, (gains, memory, sample, 0.0), when))
    return Unit(name, f"law {law.name}", tuple(entries), {"gains": gains}, state, period)
