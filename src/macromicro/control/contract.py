"""Checks that a control law of another package meets the contract of every law."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterator
from typing import Any

from macromicro.conformance import (
    NO_KERNEL,
    OTHER_BITS,
    Broken,
    Checks,
    Finding,
    failures,
    perform,
    require,
    runs,
)
from macromicro.control import outside
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError
from macromicro.kernel import compiled
from macromicro.nominal import COUNTS, FINE_STOP, PERIOD, PITCH
from macromicro.schema.par import entries
from macromicro.schema.text import printable

PERIODS = (1e-4, 1e-3, 1e-2)  # s
_STEPS = 200
_HUGE = 1e3  # times the travel


Run = list[tuple[Any, float]]  # memory and effort of each period


def check(law: StageLaw | Any, name: str = "the law") -> Iterator[Finding]:
    """Check a law on simulated targets and readings.

    Parameters
    ----------
    law : StageLaw | Any
        A law, or a class that is one.
    name : str, optional
        Its name, for messages.

    Yields
    ------
    Finding
        Each result; checks that depend on a failed one are skipped.

    Examples
    --------
    >>> from macromicro.control.contract import check
    >>> from macromicro.control.pid_heat import LAW
    >>> [each.what for each in check(LAW) if each.passed][:4]
    ['shape', 'gains', 'signature', 'memory']
    """
    try:
        law = outside.check(law, name, "law")
    except InputError as error:
        yield Finding("shape", False, f"{error.where}: {error.value}", error.accepted)
        return
    yield Finding("shape", True, f"gains {', '.join(law.gains._fields)}; positions in {law.unit}")
    yield from perform(_CHECKS, law, first=("signature", "memory"))


def broken(law: StageLaw | Any, name: str = "the law") -> list[str]:
    """The failed checks of a law, for a test: an empty list if all is well.

    Parameters
    ----------
    law : StageLaw | Any
        A law, or a class that is one.
    name : str, optional
        Its name, for messages.

    Returns
    -------
    list[str]
        A line for each.

    Examples
    --------
    >>> from macromicro.control.contract import broken
    >>> from macromicro.control.pid_heat import LAW
    >>> broken(LAW)
    []
    >>> broken(LAW._replace(step=lambda gains, memory: (memory, 0.0)))[0]
    'signature: step: too many positional arguments; step(gains, memory, target, sample, dt)'
    """
    return failures(check(law, name))


def _run(law: StageLaw, errors: list[float], dt: float = PERIOD, step: Any = None) -> Run:
    """A simulated stage at these errors from a moving target."""
    gains, one = _arguments(law), step or law.step
    far = _travel(law)
    first = Sample(0.0, -errors[0])
    memory, done = law.start(gains, first), []
    for k, error in enumerate(errors):
        place = 0.1 * far * math.sin(k * dt)
        target = Target(place, 0.1 * far * math.cos(k * dt), -place, math.inf)
        answer = one(gains, memory, target, Sample(k * dt, place - error), dt)
        memory, effort = _check_answer(law, answer)
        done.append((law.tell(memory), effort))
    return done


def _arguments(law: StageLaw) -> Any:
    """Arguments of the law's functions."""
    return outside.arguments(law, law.gains())


def _travel(law: StageLaw) -> float:
    if law.rest is not None:
        return FINE_STOP
    return COUNTS if law.unit == "count" else COUNTS * PITCH


def _course(law: StageLaw) -> list[float]:
    """Small and large errors of either sign, and zero."""
    far = _travel(law)
    return [far * math.sin(0.37 * k) ** 3 for k in range(_STEPS)]


def _gains(law: StageLaw) -> str:
    for entry in entries(law.gains()):
        parts = entry.value if law.prepare and isinstance(entry.value, tuple) else (entry.value,)
        floats = all(isinstance(part, float) for part in parts)
        remedy = "floats alone: compiled code and the search need one type"
        require(floats, f"{entry.path} = {entry.value!r}", remedy)
        try:
            for part in parts:
                entry._replace(value=part).check(part, entry.path)
        except InputError as error:
            raise Broken(f"default of {entry.path}: {error.value}", error.accepted) from None
    return "the defaults are within their bounds"


def _signature(law: StageLaw) -> str:
    for part, words in (
        ("start", ("gains", "sample")),
        ("step", ("gains", "memory", "target", "sample", "dt")),
    ):
        try:
            inspect.signature(getattr(law, part)).bind(*words)
        except TypeError as error:
            raise Broken(f"{part}: {error}", f"{part}({', '.join(words)})") from None
    return "start(gains, sample), step(gains, memory, target, sample, dt)"


def _memory(law: StageLaw) -> str:
    _check_memory(law, law.start(_arguments(law), Sample(0.0, 0.0)))
    _run(law, _course(law))
    return f"{law.memory.__name__}: {', '.join(law.memory._fields)}"


def _check_answer(law: StageLaw, answer: Any) -> tuple[Any, float]:
    pair = isinstance(answer, tuple) and len(answer) == 2
    require(pair, f"step returns {printable(answer)}", "(memory, effort)")
    memory, effort = answer
    words = f"an effort of type {type(effort).__name__}"
    require(isinstance(effort, float), words, "a float, in V")
    _check_memory(law, memory)
    return memory, effort


def _check_memory(law: StageLaw, memory: Any) -> None:
    """Raise unless this is a memory of the law, always of one type."""
    kind, memory = law.memory, law.tell(memory)
    words = f"a memory of type {type(memory).__name__}"
    require(type(memory) is kind, words, f"{kind.__name__}(...) from start and from step")
    for name, value in zip(kind._fields, memory, strict=True):
        words = f"{name} = {value!r} in the memory"
        require(isinstance(value, float), words, "floats alone, 0.0 and not 0")


def _purity(law: StageLaw) -> str:
    course = _course(law)
    first = _run(law, course)
    _run(law, course[::-1])
    require(
        _run(law, course) == first,
        "the same gains, targets and readings gave other efforts",
        "keep nothing outside of the memory: no attribute, no global, no clock, no chance",
    )
    return "the same input gives the same effort"


def _finite(law: StageLaw) -> str:
    far = _travel(law)
    for error in (0.0, far, -far, _HUGE * far, -_HUGE * far):
        for _, effort in _run(law, [error] * 20):
            words = f"{effort} V at an error of {error:g} {law.unit}"
            require(math.isfinite(effort), words, "no division by what may be 0, no overflow")
    return f"errors from 0 to {_HUGE:g} times the travel"


def _direction(law: StageLaw) -> str:
    gains, far = _arguments(law), 0.5 * _travel(law)
    efforts, one_way = [], law.rest is not None  # a wire comes back by itself
    for error in (far, -far):
        sample = Sample(0.0, 0.0)
        memory, effort = law.start(gains, sample), 0.0
        for k in range(5):
            target = Target(error, 0.0, 0.0, math.inf)
            memory, effort = law.step(gains, memory, target, Sample(k * PERIOD, 0.0), PERIOD)
        efforts.append(effort)
    above, below = efforts
    right = above > 0.0 and (below == 0.0 if one_way else below < 0.0)
    words = f"{above:g} V towards a target above, {below:g} V towards one below"
    require(right, words, "a positive effort drives up: check the sign of target less reading")
    return "a target above gets a positive effort, one below a negative one"


def _periods(law: StageLaw) -> str:
    for dt in PERIODS:
        for _, effort in _run(law, _course(law), dt):
            words = f"{effort} V at a period of {dt:g} s"
            require(math.isfinite(effort), words, "use dt, and never 1/dt of 0")
    return f"{', '.join(f'{1e3 * dt:g}' for dt in PERIODS)} ms"


def _check_compiled(law: StageLaw) -> str:
    if not outside.compiles(law):
        return "no: plain Python, it runs interpreted; mark start and step with @kernel for speed"
    course, fast = _course(law), compiled(law.step)
    first = _arguments(law), law.start(_arguments(law), Sample(0.0, 0.0))
    target, remedy = Target(0.0, 0.0, 0.0, math.inf), f"{NO_KERNEL}; or no @kernel"
    runs(lambda: fast(*first, target, Sample(0.0, 0.0), PERIOD), remedy)
    for (_, slow), (_, quick) in zip(_run(law, course), _run(law, course, step=fast), strict=True):
        same = math.isclose(slow, quick, rel_tol=1e-12, abs_tol=1e-300)
        require(same, f"{quick!r} V compiled, {slow!r} V interpreted", OTHER_BITS)
    return "yes, with the same efforts as interpreted"


_CHECKS: Checks = (
    ("gains", _gains),
    ("signature", _signature),
    ("memory", _memory),
    ("purity", _purity),
    ("finite effort", _finite),
    ("direction", _direction),
    ("other periods", _periods),
    ("compiled", _check_compiled),
)
