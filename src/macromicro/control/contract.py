"""Checks that a control law of another package meets the contract of every law."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, NamedTuple

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


class Finding(NamedTuple):
    """One thing that was looked at."""

    what: str  #: of the law
    passed: bool  #: whether it is as it must be
    found: str  #: in words
    remedy: str = ""  #: what to do; "" for nothing


class Broken(Exception):
    """What a plug-in does that it must not, and what to do.

    Examples
    --------
    >>> from macromicro.control.contract import Broken
    >>> Broken("at rest the effort is 1 V", "give 0 V without an error").remedy
    'give 0 V without an error'
    """

    def __init__(self, found: str, remedy: str) -> None:
        super().__init__(found)
        self.remedy = remedy


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
        law = outside.checked(law, name, "law")
    except InputError as error:
        yield Finding("shape", False, f"{error.where}: {error.value}", error.accepted)
        return
    yield Finding("shape", True, f"gains {', '.join(law.gains._fields)}; positions in {law.unit}")
    looks: tuple[tuple[str, Look], ...] = (
        ("gains", _gains),
        ("signature", _signature),
        ("memory", _memory),
        ("purity", _purity),
        ("finite effort", _finite),
        ("direction", _direction),
        ("other periods", _periods),
        ("compiled", _compiled),
    )
    yield from looked(law, looks, ("signature", "memory"))


Look = Callable[[Any], str]


def looked(it: Any, looks: Sequence[tuple[str, Look]], first: Collection[str]) -> Iterator[Finding]:
    """Run checks one after the other.

    Parameters
    ----------
    it : Any
        The object to check.
    looks : Sequence[tuple[str, Look]]
        Name of each check, and a function of `it` that returns a finding or raises `Broken`.
    first : Collection[str]
        Checks that the others depend on: an exception there ends the run.

    Yields
    ------
    Finding
        One for each check.

    Examples
    --------
    >>> from macromicro.control.contract import looked
    >>> looks = [("gain", lambda it: f"{it:g} V/m"), ("time", lambda it: f"{1.0 / it:g} s")]
    >>> [(each.what, each.passed) for each in looked(0.0, looks, first=())]
    [('gain', True), ('time', False)]
    """
    for what, look in looks:
        try:
            yield Finding(what, True, look(it))
        except Broken as error:
            yield Finding(what, False, str(error), error.remedy)
        except Exception as error:  # whatever the user's code does
            words = f"{type(error).__name__}: {printable(' '.join(str(error).split()), 300)}"
            yield Finding(what, False, words, "fix what raises it")
            if what in first:
                return


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
    found = [each for each in check(law, name) if not each.passed]
    return [f"{each.what}: {each.found}; {each.remedy}" for each in found]


def _run(law: StageLaw, errors: list[float], dt: float = PERIOD, step: Any = None) -> Run:
    """A simulated stage at these errors from a moving target."""
    gains, one = _given(law), step or law.step
    far = _travel(law)
    first = Sample(0.0, -errors[0])
    memory, done = law.start(gains, first), []
    for k, error in enumerate(errors):
        place = 0.1 * far * math.sin(k * dt)
        target = Target(place, 0.1 * far * math.cos(k * dt), -place, math.inf)
        answer = one(gains, memory, target, Sample(k * dt, place - error), dt)
        memory, effort = _answered(law, answer)
        done.append((law.tell(memory), effort))
    return done


def _given(law: StageLaw) -> Any:
    """Arguments of the law's functions."""
    return outside.given(law, law.gains())


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
        if any(isinstance(part, bool) or not isinstance(part, float) for part in parts):
            remedy = "floats alone: compiled code and the search need one type"
            raise Broken(f"{entry.path} = {entry.value!r}", remedy)
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
    _remembered(law, law.start(_given(law), Sample(0.0, 0.0)))
    _run(law, _course(law))
    return f"{law.memory.__name__}: {', '.join(law.memory._fields)}"


def _answered(law: StageLaw, answer: Any) -> tuple[Any, float]:
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise Broken(f"step returns {printable(answer)}", "(memory, effort)")
    memory, effort = answer
    if not isinstance(effort, float):
        raise Broken(f"an effort of type {type(effort).__name__}", "a float, in V")
    _remembered(law, memory)
    return memory, effort


def _remembered(law: StageLaw, memory: Any) -> None:
    """Raise unless this is a memory of the law, always of one type."""
    kind, memory = law.memory, law.tell(memory)
    if type(memory) is not kind:
        words = f"a memory of type {type(memory).__name__}"
        raise Broken(words, f"{kind.__name__}(...) from start and from step")
    for name, value in zip(kind._fields, memory, strict=True):
        if not isinstance(value, float):
            raise Broken(f"{name} = {value!r} in the memory", "floats alone, 0.0 and not 0")


def _purity(law: StageLaw) -> str:
    course = _course(law)
    first = _run(law, course)
    _run(law, course[::-1])
    if _run(law, course) != first:
        raise Broken(
            "the same gains, targets and readings gave other efforts",
            "keep nothing outside of the memory: no attribute, no global, no clock, no chance",
        )
    return "the same input gives the same effort"


def _finite(law: StageLaw) -> str:
    far = _travel(law)
    for error in (0.0, far, -far, _HUGE * far, -_HUGE * far):
        for _, effort in _run(law, [error] * 20):
            if not math.isfinite(effort):
                words = f"{effort} V at an error of {error:g} {law.unit}"
                raise Broken(words, "no division by what may be 0, no overflow")
    return f"errors from 0 to {_HUGE:g} times the travel"


def _direction(law: StageLaw) -> str:
    gains, far = _given(law), 0.5 * _travel(law)
    efforts, one_way = [], law.rest is not None  # a wire comes back by itself
    for error in (far, -far):
        sample = Sample(0.0, 0.0)
        memory, effort = law.start(gains, sample), 0.0
        for k in range(5):
            target = Target(error, 0.0, 0.0, math.inf)
            memory, effort = law.step(gains, memory, target, Sample(k * PERIOD, 0.0), PERIOD)
        efforts.append(effort)
    above, below = efforts
    if not above > 0.0 or not (below == 0.0 if one_way else below < 0.0):
        words = f"{above:g} V towards a target above, {below:g} V towards one below"
        raise Broken(words, "a positive effort drives up: check the sign of target less reading")
    return "a target above gets a positive effort, one below a negative one"


def _periods(law: StageLaw) -> str:
    for dt in PERIODS:
        for _, effort in _run(law, _course(law), dt):
            if not math.isfinite(effort):
                raise Broken(f"{effort} V at a period of {dt:g} s", "use dt, and never 1/dt of 0")
    return f"{', '.join(f'{1e3 * dt:g}' for dt in PERIODS)} ms"


def _compiled(law: StageLaw) -> str:
    if not outside.compiles(law):
        return "no: plain Python, it runs interpreted; mark start and step with @kernel for speed"
    course, fast = _course(law), compiled(law.step)
    first = _given(law), law.start(_given(law), Sample(0.0, 0.0))
    try:
        fast(*first, Target(0.0, 0.0, 0.0, math.inf), Sample(0.0, 0.0), PERIOD)
    except Exception as error:  # numba's own, of which it has many
        words = " ".join(str(error).split())[:200]
        remedy = "floats, math and NamedTuples alone (CONTRIBUTING.md, Kernels); or no @kernel"
        raise Broken(f"it does not compile: {words}", remedy) from None
    for (_, slow), (_, quick) in zip(_run(law, course), _run(law, course, step=fast), strict=True):
        if not math.isclose(slow, quick, rel_tol=1e-12, abs_tol=1e-300):
            words = f"{quick!r} V compiled, {slow!r} V interpreted"
            raise Broken(words, "x * x for x**2, math.sqrt for math.hypot; no division by 0")
    return "yes, with the same efforts as interpreted"
