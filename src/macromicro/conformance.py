"""Checks of what a user brings (a law, a machine, a rig): call it, look at the answer, say it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from macromicro.errors import MacromicroError
from macromicro.schema.text import printable

NO_KERNEL = "floats, math and NamedTuples alone (CONTRIBUTING.md, Kernels)"
OTHER_BITS = "x * x for x**2, math.sqrt for math.hypot; no division by 0"


class Finding(NamedTuple):
    what: str  # was checked
    passed: bool
    found: str  # in words
    remedy: str = ""  # "" for nothing to do


class Broken(Exception):
    """What a plug-in does that it must not, and the remedy."""

    def __init__(self, found: str, remedy: str) -> None:
        super().__init__(found)
        self.remedy = remedy


# Name of each check, and a function that returns the finding in words or raises `Broken`.
Checks = Sequence[tuple[str, Callable[..., str]]]


def require(right: bool, found: str, remedy: str) -> None:
    """Raise `Broken` unless it is right."""
    if not right:
        raise Broken(found, remedy)


def perform(checks: Checks, *it: Any, first: Collection[str] = ()) -> Iterator[Finding]:
    """Perform checks of `it` one after the other; a failed one of `first` ends them."""
    for what, check in checks:
        try:
            yield Finding(what, True, check(*it))
            continue
        except Broken as error:
            yield Finding(what, False, str(error), error.remedy)
        except Exception as error:  # whatever the user's code does
            yield failure(what, error)
        if what in first:
            return


def failure(what: str, error: Exception, remedy: str = "fix what raises it") -> Finding:
    """The finding of a check that raised."""
    own = isinstance(error, MacromicroError)
    text = str(error) if own else f"{type(error).__name__}: {error}"
    return Finding(what, False, printable(" ".join(text.split()), 300), remedy)


def failures(findings: Iterable[Finding]) -> list[str]:
    """A line for each failed check."""
    return [f"{each.what}: {each.found}; {each.remedy}" for each in findings if not each.passed]


def runs(call: Callable[[], Any], remedy: str = NO_KERNEL, verb: str = "compile") -> Any:
    """The answer of compiled code; `Broken` where the compiler refuses it."""
    try:
        return call()
    except Exception as error:  # numba's own, of which it has many
        words = " ".join(str(error).split())[:200]
        raise Broken(f"it does not {verb}: {words}", remedy) from None
