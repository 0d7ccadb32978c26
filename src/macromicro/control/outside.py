"""Control laws by the contract of `stage_law`, shipped or from other packages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from macromicro import joining, kernel
from macromicro.arrays import Array
from macromicro.columns import Column, layout
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError, ProblemError
from macromicro.kernel import by_type, is_kernel
from macromicro.schema import plugins
from macromicro.schema.par import Par, entries
from macromicro.schema.text import printable

GROUP = "macromicro.laws"
SHIPPED = {"terminal": "macromicro.control.terminal.law:TERMINAL"}
FINE = {  # of the micro-stage
    "inverse": "macromicro.control.inverse.law:INVERSE",
    "pid-heat": "macromicro.control.pid_heat:LAW",
}
FORM = "MODULE:LAW, a law of your own (docs/laws.md)"
UNITS = ("m", "count")
STAGES = ("macro", "micro")  # whose model a law's gains may be
PREFIX = "law_"  # of columns
FRESH, RESTED = 1.0, 2.0  # see `Held`
_NEEDED = ("gains", "memory", "start", "step")
_OPTIONAL = ("unit", "compensated", "again", "prepare", "params", "rest", "kept", "model_of")
_SHAPE = (
    "A law is a macromicro.control.stage_law.StageLaw, or a class with its gains, memory, start "
    "and step (docs/laws.md)."
)


class NoGains(NamedTuple):
    pass


class Held(NamedTuple):
    # `FRESH` before the law's first period, when its `start` is due; then 0; `RESTED` after a
    # rest, when its `again` is
    fresh: float
    memory: Any  # of the law; of no meaning while it is fresh


Kept = tuple[Held, ...]  # none or one

_laws: dict[str, StageLaw] = {}
_by_gains: dict[type, str] = {}


def is_name(name: str) -> bool:
    """Whether a text may name a law of another package."""
    return place(name) is not None


def place(name: str) -> str | None:
    return SHIPPED.get(name) or FINE.get(name) or plugins.place(name, GROUP)


def offered_laws(fine: bool = False) -> tuple[str, ...]:
    """Names of the laws offered by this package and by installed ones."""
    return (*(FINE if fine else SHIPPED), *plugins.entry_points(GROUP))


def find(name: str, where: str) -> StageLaw:
    """The law of a name, imported at the first call."""
    if name not in _laws:
        law = check(import_law(name, where), name, where)
        other = _by_gains.setdefault(law.gains, name)
        _by_gains.setdefault(law.params or law.gains, name)
        if other != name and _laws[other] != law:
            problem = f"{printable(name)} has the gains of {other}, {law.gains.__name__}"
            raise ProblemError(where, problem, "Give each law a type of gains of its own.")
        _laws[name] = law
        if compiles(law) and joining.foreign(law.step):
            joining.admit(name, law.start, law.step)
    return _laws[name]


def suitable_law(name: str, stage: str, where: str) -> StageLaw:
    law = find(name, where)
    if law.model_of not in ("", stage):
        other = f"the {law.model_of}-stage of the machine two_stage"
        problem = f"the gains of {printable(name)} are a model of {other}"
        raise ProblemError(where, problem, "Choose a law without a model of another machine.")
    return law


def import_law(name: str, where: str) -> Any:
    """The object under a law's name in a user's module."""
    there = place(name)
    assert there is not None  # as `is_name` says
    return plugins.load(there, where, "a law", _suits)


def _suits(made: Any) -> bool:
    return isinstance(made, StageLaw) or all(hasattr(made, part) for part in _NEEDED)


def check(made: Any, name: str, where: str) -> StageLaw:
    """That object, checked."""
    if isinstance(made, StageLaw):
        law = made
    else:
        missing = [part for part in _NEEDED if not hasattr(made, part)]
        if missing:
            kind = made.__name__ if isinstance(made, type) else type(made).__name__
            raise ProblemError(where, f"{name}, {kind}, lacks {', '.join(missing)}", _SHAPE)
        it = made() if isinstance(made, type) else made
        rest = {n: getattr(it, n) for n in _OPTIONAL if hasattr(it, n)}
        law = StageLaw(name, it.gains, it.memory, it.start, it.step, **rest)
    for part, accepted in _wrong(law):
        raise InputError(f"{where}, {part} of {name}", printable(getattr(law, part)), accepted)
    return law


def _wrong(law: StageLaw) -> list[tuple[str, str]]:
    """Parts unsuitable for a law, with what is accepted."""
    floats = "a NamedTuple of floats"
    found = []
    if not (_tuple_class(law.gains) and _defaults(law.gains)):
        found.append(("gains", f"{floats} with defaults"))
    elif len(list(entries(law.gains()))) < len(law.gains._fields):
        found.append(("gains", f"{floats}, each annotated with a {Par.__module__}.Par"))
    if not _tuple_class(law.memory):
        found.append(("memory", f"a class, {floats}"))
    found += [(p, "a function") for p in ("start", "step") if not callable(getattr(law, p))]
    if law.unit not in UNITS:
        found.append(("unit", " or ".join(map(repr, UNITS))))
    if law.model_of not in ("", *STAGES):
        found.append(("model_of", " or ".join(map(repr, ("", *STAGES)))))
    return found


def _tuple_class(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields")


def _defaults(kind: Any) -> bool:
    return len(kind._field_defaults) == len(kind._fields) > 0


def compiles(law: StageLaw) -> bool:
    return is_kernel(law.step) and is_kernel(law.rest or law.start)


def digest(name: str) -> str:
    """Digest of a law's sources."""
    law = _laws[name]
    return joining.sources(law.start, law.step, also=compiles(law))


def of(gains: Any) -> str:
    return _by_gains.get(type(gains), "")


def law_of_gains(gains: Any) -> StageLaw:
    return law_of_type(type(gains))


def arguments(law: StageLaw, gains: Any) -> Any:
    """Arguments of a law's functions."""
    return gains if law.prepare is None else law.prepare(gains)


def law_of_type(gains: type) -> StageLaw:
    """The law of a type of gains, or of their `prepare`d form."""
    return _laws[_by_gains[gains]]


def found_types() -> tuple[Any, ...]:
    """Types of gains of all laws found so far."""
    return tuple(_by_gains)


def _begin_of(gains: Any) -> Callable[..., Any]:
    if len(gains) == 0:
        return lambda gains: ()
    kind = _laws[_by_gains[gains[0].instance_class]].memory
    zeros = (0.0,) * len(kind._fields)
    return lambda gains: (Held(FRESH, kind(*zeros)),)


@by_type(_begin_of)
def begin(gains: tuple[Any, ...]) -> Kept:
    """The memory before a law's first period, with its final type."""
    kinds = [law_of_gains(each).memory for each in gains]
    return tuple(Held(FRESH, kind(*[0.0] * len(kind._fields))) for kind in kinds)


def _again(kept: Any) -> Callable[..., Any]:
    if len(kept) == 0:
        return lambda kept: ()
    return lambda kept: (Held(FRESH if kept[0].fresh == FRESH else RESTED, kept[0].memory),)


@by_type(_again)
def again(kept: Kept) -> Kept:
    """The memory, reset."""
    return tuple(Held(FRESH if held.fresh == FRESH else RESTED, held.memory) for held in kept)


def _anew(start: Callable[[Any, Sample], Any]) -> Callable[[Any, Any, Sample], Any]:
    """`again` of a law that keeps nothing."""

    @kernel.kernel
    def again(gains: Any, memory: Any, sample: Sample) -> Any:
        return start(gains, sample)

    return again


def _step(gains: Any, kept: Any, target: Any, sample: Any, dt: Any) -> Callable[..., Any]:
    if len(gains) == 0:
        return lambda gains, kept, target, sample, dt: ((), 0.0)
    law = _laws[_by_gains[gains[0].instance_class]]
    start, one = law.start, law.step
    again = law.again or _anew(start)

    def chosen(
        gains: tuple[Any, ...], kept: Kept, target: Target, sample: Sample, dt: float
    ) -> tuple[Kept, float]:
        memory = kept[0].memory
        if kept[0].fresh == RESTED:
            memory = again(gains[0], memory, sample)
        elif kept[0].fresh == FRESH:
            memory = start(gains[0], sample)
        memory, effort = one(gains[0], memory, target, sample, dt)
        return (Held(0.0, memory),), effort

    return chosen


@by_type(_step)
def step(
    gains: tuple[Any, ...], kept: Kept, target: Target, sample: Sample, dt: float
) -> tuple[Kept, float]:
    law = law_of_gains(gains[0])
    if not kept or kept[0].fresh == FRESH:
        memory = law.start(gains[0], sample)
    elif kept[0].fresh == RESTED:
        memory = (law.again or _anew(law.start))(gains[0], kept[0].memory, sample)
    else:
        memory = kept[0].memory
    memory, effort = law.step(gains[0], memory, target, sample, dt)
    return (Held(0.0, memory),), effort


def columns(gains: tuple[Any, ...]) -> tuple[Column, ...]:
    """Columns of a law's memory: the fields annotated with a `Quantity`."""
    found = [c for each in gains for c in layout(law_of_gains(each).memory).columns]
    return tuple(c._replace(name=f"{PREFIX}{c.name}", dtype="f8") for c in found)


def values(kept: Kept) -> list[float]:
    """Their values now."""
    found = []
    for held in kept:
        (part,) = layout(type(held.memory)).parts
        rows = zip(*part, held.memory, strict=True)
        found += [float(scale * value) for row, scale, value in rows if row >= 0]
    return found


def _note(out: Any, k: Any, kept: Any, first: Any) -> Callable[..., Any]:
    if len(kept) == 0:
        return lambda out, k, kept, first: None
    (part,) = layout(kept[0].types[1].instance_class).parts
    rows, scales = part

    def noted(out: Array, k: int, kept: Kept, first: int) -> None:
        memory = kept[0].memory
        for j in range(len(memory)):
            if rows[j] >= 0:
                out[first + rows[j], k] = scales[j] * memory[j]

    return noted


@by_type(_note)
def note(out: Array, k: int, kept: Kept, first: int) -> None:
    """Write the recorded part of a law's memory into a block."""
    for held in kept:
        (part,) = layout(type(held.memory)).parts
        for row, scale, value in zip(*part, held.memory, strict=True):
            if row >= 0:
                out[first + row, k] = scale * value


def _rows(kept: Any) -> Callable[..., Any]:
    if len(kept) == 0:
        return lambda kept: 0
    count = len(layout(kept[0].types[1].instance_class).columns)
    return lambda kept: count


@by_type(_rows)
def rows(kept: Kept) -> int:
    """Number of rows that `note` writes."""
    return sum(len(layout(type(held.memory)).columns) for held in kept)


def _integral(kept: Any) -> Callable[..., Any]:
    if len(kept) == 0 or "integral" not in kept[0].types[1].fields:
        return lambda kept: 0.0
    return lambda kept: kept[0].memory.integral


@by_type(_integral)
def integral(kept: Kept) -> float:
    """Integral effort, if the memory has a field `integral`."""
    return float(getattr(kept[0].memory, "integral", 0.0)) if kept else 0.0
