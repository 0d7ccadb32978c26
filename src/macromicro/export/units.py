"""A unit of export: functions under one name, with their parameters and state."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

from macromicro.control import outside
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import ProblemError
from macromicro.kernel import is_kernel


class Entry(NamedTuple):
    """A function that the user of the exported code calls."""

    name: str  # in C, behind the unit's
    function: Callable[..., Any]  # the kernel
    arguments: tuple[Any, ...]  # an example of each, or its type
    # its occasion, for what is called instead of the others and not in each period; "" otherwise
    when: str = ""


class Unit(NamedTuple):
    name: str
    title: str  # for people
    entries: tuple[Entry, ...]  # what is called, in the order of a period
    given: dict[str, Any]  # parameters and tables that are written into the code
    state: Any = None  # at the start; None for what has none, or makes it in a function of its own
    period: float = 1e-3  # control period for the example, s
    # numbers that a function takes and returns, where no state holds them
    memory: tuple[str, ...] = ()


Made = dict[str, Callable[[], Unit]]


def law_of(name: str, law: StageLaw, gains: Any, period: float) -> Unit:
    if not is_kernel(law.step):
        remedy = "Make its step a kernel with @kernel (docs/laws.md)."
        raise ProblemError(f"law {law.name}", "plain Python", remedy)
    sample, target = Sample(0.0, 0.0), Target(0.0, 0.0, 0.0, math.inf)
    gains = outside.arguments(law, gains)
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
