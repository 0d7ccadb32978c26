"""The macro-stage's control laws: a new one is one file and its name in `FILES`.

Every law keeps its own memory. All gains and all memories travel together, because compiled
code needs types that do not depend on the law that was chosen; `step` goes to the chosen one.
The laws are put into a chain of closures, one link a law, in which gains and memory have
constant places: that compiles to as many comparisons, and no function is passed around. They
see the error alone. Gains and memory of a law of another package (`outside`), where the settings
name one, stand behind those, and it sees target and reading.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple, ParamSpec, TypeVar

from macromicro.control import deadzone, outside
from macromicro.control.law import Law
from macromicro.control.stage_law import Sample, Target
from macromicro.kernel import compiled, kernel

P = ParamSpec("P")
R = TypeVar("R")

FILES = ("pid", "pd")  # modules of this folder, each with a tuple `LAWS`
LAWS: tuple[Law, ...] = tuple(
    law for file in FILES for law in import_module(f"macromicro.control.{file}").LAWS
)
NAMES = tuple(law.name for law in LAWS)
SHIPPED = len(LAWS)

Memory = tuple[Any, ...]  # one of each law, in the order of `LAWS`; that of one of `outside`


class MacroLaw(NamedTuple):
    """The chosen law of the macro-stage, and the gains of all.

    Attributes
    ----------
    law : int
        Its place in `LAWS`; behind them: that of another package.
    dead_zone : float
        Dead zone of the inverse, V; 0 leaves the friction uncompensated.
    limit : float
        Limit of the effort, V.
    gains : tuple[Any, ...]
        Gains of every law, in the order of `LAWS`, then those of another package's.
    scale : float
        Unit of that law per count: 1, or m.
    """

    law: int
    dead_zone: float
    limit: float
    gains: tuple[Any, ...]
    scale: float = 1.0

    @property
    def own(self) -> Any:
        """The gains of the chosen law."""
        return self.gains[self.law]

    def with_gains(self, gains: Any) -> MacroLaw:
        """The same law with other gains.

        Parameters
        ----------
        gains : Any
            Gains of the chosen law.

        Returns
        -------
        MacroLaw
            The law.
        """
        every = list(self.gains)
        every[self.law] = gains
        return self._replace(gains=tuple(every))

    def machine(self, function: Callable[P, R]) -> Callable[P, R]:
        """A kernel that calls this law, at machine speed if the law can be compiled.

        Parameters
        ----------
        function : Callable[P, R]
            The kernel.

        Returns
        -------
        Callable[P, R]
            Compiled; or as it is, beside a law of plain Python.
        """
        return compiled(function) if self.compiles else function

    @property
    def compiles(self) -> bool:
        """Whether all laws that it has gains of can be compiled."""
        return all(outside.compiles(outside.having(gains)) for gains in self.gains[SHIPPED:])


def _starts(k: int) -> Callable[[float], Memory]:
    """The memories of the laws from `k` on."""
    start = LAWS[k].start
    if k + 1 == len(LAWS):

        @kernel
        def last(error: float) -> Memory:
            return (start(error),)

        return last
    rest = _starts(k + 1)

    @kernel
    def more(error: float) -> Memory:
        return (start(error), *rest(error))

    return more


def _steps(k: int) -> Callable[[MacroLaw, Memory, float, float], tuple[Memory, float]]:
    """A step of the chosen law, which is that at `k` or a later one."""
    step, after = LAWS[k].step, k + 1
    if after == len(LAWS):

        @kernel
        def last(p: MacroLaw, s: Memory, error: float, dt: float) -> tuple[Memory, float]:
            memory, effort = step(p.gains[k], s[k], error, dt)
            return (*s[:k], memory), effort

        return last
    rest = _steps(after)

    @kernel
    def more(p: MacroLaw, s: Memory, error: float, dt: float) -> tuple[Memory, float]:
        if p.law == k:
            memory, effort = step(p.gains[k], s[k], error, dt)
            return (*s[:k], memory, *s[after:]), effort
        return rest(p, s, error, dt)

    return more


_started, _stepped = _starts(0), _steps(0)


@kernel
def rest(error: float) -> Memory:
    """The memories of this package's laws before the first period.

    Parameters
    ----------
    error : float
        As if it had been there, counts.

    Returns
    -------
    Memory
        In the order of `LAWS`.
    """
    return _started(error)


@kernel
def begun(p: MacroLaw) -> Memory:
    """The memories before the first period of a run, each of the type that it will keep.

    Parameters
    ----------
    p : MacroLaw
        The law.

    Returns
    -------
    Memory
        Of all laws, without an error before.
    """
    return (*_started(0.0), *outside.begun(p.gains[SHIPPED:]))


@kernel
def again(s: Memory) -> Memory:
    """Memories as before the first period.

    Parameters
    ----------
    s : Memory
        Of all laws.

    Returns
    -------
    Memory
        The same laws', without an error before.
    """
    return (*_started(0.0), *outside.again(s[SHIPPED:]))


@kernel
def step(p: MacroLaw, s: Memory, target: Target, sample: Sample, dt: float) -> tuple[Memory, float]:
    """One period of the chosen law.

    Parameters
    ----------
    p : MacroLaw
        The law.
    s : Memory
        Memories of all laws.
    target : Target
        Counts; of another package's law without memory yet, `s` may end before it.
    sample : Sample
        Counts.
    dt : float
        Control period, s.

    Returns
    -------
    memory : Memory
        New memories.
    effort : float
        Effort at the D/A, lifted over the dead zone and saturated, V.
    """
    if p.law < SHIPPED:
        mine, effort = _stepped(p, s[:SHIPPED], target.position - sample.position, dt)
        return (*mine, *s[SHIPPED:]), sent(effort, p.dead_zone, p.limit)
    size = p.scale
    aim = Target(
        target.position * size, target.velocity * size, target.acceleration * size, target.turn
    )
    seen = Sample(sample.t, sample.position * size)
    own, effort = outside.step(p.gains[SHIPPED:], s[SHIPPED:], aim, seen, dt)
    return (*s[:SHIPPED], *own), sent(effort, p.dead_zone, p.limit)


def _integrals(k: int) -> Callable[[Memory], float]:
    """The sum of what the laws from `k` on have integrated; all but the chosen one rest."""
    rest = _integrals(k + 1) if k + 1 < len(LAWS) else _nothing
    if not hasattr(LAWS[k].start(0.0), "integral"):
        return rest

    @kernel
    def more(s: Memory) -> float:
        return float(s[k].integral) + rest(s)

    return more


@kernel
def _nothing(s: Memory) -> float:
    return 0.0


_integrated = _integrals(0)


@kernel
def integral(s: Memory) -> float:
    """Integral effort, for the recording: of a law whose memory has a field `integral`.

    Parameters
    ----------
    s : Memory
        Memories of all laws.

    Returns
    -------
    float
        V.
    """
    return _integrated(s) + outside.integral(s[SHIPPED:])


@kernel
def sent(effort: float, dead_zone: float, limit: float) -> float:
    """An effort, lifted over the dead zone and saturated.

    Parameters
    ----------
    effort : float
        Effort of a law, V.
    dead_zone : float
        Dead zone, V.
    limit : float
        Limit, V.

    Returns
    -------
    float
        V at the D/A.
    """
    if dead_zone > 0.0:
        effort = deadzone.inverse(dead_zone, effort)
    return min(max(effort, -limit), limit)
