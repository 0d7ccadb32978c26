"""The macro-stage's control laws: a new one is one file and its name in `FILES`.

Every law keeps its own memory. All gains and all memories travel together, because compiled
code needs types that do not depend on the law that was chosen; `step` goes to the chosen one.
The laws are put into a chain of closures, one link a law, in which gains and memory have
constant places: that compiles to as many comparisons, and no function is passed around.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple

from macromicro.control import deadzone
from macromicro.control.law import Law
from macromicro.kernel import kernel

FILES = ("pid", "pd")  # modules of this folder, each with a tuple `LAWS`
LAWS: tuple[Law, ...] = tuple(
    law for file in FILES for law in import_module(f"macromicro.control.{file}").LAWS
)
NAMES = tuple(law.name for law in LAWS)

Memory = tuple[Any, ...]  # one of each law, in the order of `LAWS`


class MacroLaw(NamedTuple):
    """The chosen law of the macro-stage, and the gains of all.

    Attributes
    ----------
    law : int
        Its place in `LAWS`.
    dead_zone : float
        Dead zone of the inverse, V; 0 leaves the friction uncompensated.
    limit : float
        Limit of the effort, V.
    gains : tuple[Any, ...]
        Gains of every law, in the order of `LAWS`.
    """

    law: int
    dead_zone: float
    limit: float
    gains: tuple[Any, ...]

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
    """The memories of all laws before the first period.

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
def step(p: MacroLaw, s: Memory, error: float, dt: float) -> tuple[Memory, float]:
    """One period of the chosen law.

    Parameters
    ----------
    p : MacroLaw
        The law.
    s : Memory
        Memories of all laws.
    error : float
        Error, counts.
    dt : float
        Control period, s.

    Returns
    -------
    memory : Memory
        New memories.
    effort : float
        Effort at the D/A, lifted over the dead zone and saturated, V.
    """
    memory, effort = _stepped(p, s, error, dt)
    return memory, sent(effort, p.dead_zone, p.limit)


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
    return _integrated(s)


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
