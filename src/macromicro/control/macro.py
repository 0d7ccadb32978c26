"""The macro-stage's control laws: a new one is one file and its name in `FILES`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any, NamedTuple, ParamSpec, TypeVar

from macromicro.columns import Meaning
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
    """The chosen law of the macro-stage, with the gains of all."""

    law: Annotated[int, Meaning("its place in LAWS; behind them: that of another package")]
    dead_zone: Annotated[
        float, Meaning("dead zone of the inverse; 0 leaves the friction uncompensated", "V")
    ]
    limit: Annotated[float, Meaning("limit of the effort", "V")]
    gains: Annotated[
        tuple[Any, ...],
        Meaning("gains of every law, in the order of LAWS, then those of another package's"),
    ]
    scale: Annotated[float, Meaning("unit of that law per count: 1, or m")] = 1.0

    @property
    def own(self) -> Any:
        return self.gains[self.law]

    def with_gains(self, gains: Any) -> MacroLaw:
        every = list(self.gains)
        every[self.law] = gains
        return self._replace(gains=tuple(every))

    def machine(self, function: Callable[P, R]) -> Callable[P, R]:
        """A kernel that calls this law, compiled if the law can be."""
        return compiled(function) if self.compiles else function

    @property
    def compiles(self) -> bool:
        return all(outside.compiles(outside.law_of_gains(gains)) for gains in self.gains[SHIPPED:])


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
    """A step of the chosen law, at index `k` or later."""
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
    """The memories before the first period (`error` in counts)."""
    return _started(error)


@kernel
def begun(p: MacroLaw) -> Memory:
    """The memories before a run, with their final types."""
    return (*_started(0.0), *outside.begin(p.gains[SHIPPED:]))


@kernel
def again(s: Memory) -> Memory:
    """The memories, reset."""
    return (*_started(0.0), *outside.again(s[SHIPPED:]))


@kernel
def step(
    p: MacroLaw, s: Memory, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[Memory, Meaning(name="memory")], Annotated[float, Meaning("", "V", name="effort")]
]:
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
    """The integral of the chosen law, by summing over all laws."""
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
    """Integral effort for the recording."""
    return _integrated(s) + outside.integral(s[SHIPPED:])


@kernel
def sent(effort: float, dead_zone: float, limit: float) -> float:
    """An effort, lifted over the dead zone and saturated."""
    if dead_zone > 0.0:
        effort = deadzone.inverse(dead_zone, effort)
    return min(max(effort, -limit), limit)
