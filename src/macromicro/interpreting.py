"""A loop is interpreted as long as that takes less time than to compile it."""

from __future__ import annotations

import contextlib
import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from macromicro.kernel import cache_folder, compiled

FEW = 30_000  # control periods: interpreted in 4 to 15 s, as long as their loop compiles


def is_quicker(loop: Callable[..., Any], periods: float, *arguments: Any) -> bool:
    """Whether so many control periods are over before their loop is compiled.

    There is no machine code for such arguments yet, and with all that were interpreted before
    they are `FEW`: whoever runs a machine again and again has it compiled.
    """
    dispatcher: Any = compiled(loop)
    if dispatcher is loop:  # NUMBA_DISABLE_JIT is set
        return True
    types = tuple(map(dispatcher.typeof_pyval, arguments))
    if types in dispatcher.overloads or _before(loop, types) + periods > FEW:
        return False
    stem = Path(loop.__code__.co_filename).stem
    if not any(Path(dispatcher.stats.cache_path).glob(f"{stem}.*.nbi")):
        return True  # said without the second that a compiler needs to begin
    # tests/test_kernel.py says what to do in the version of numba that has another cache.
    return dispatcher._cache.load_overload(types, dispatcher.targetctx) is None


def quickest(loop: Callable[..., Any], periods: float, *arguments: Any) -> Callable[..., Any]:
    """A loop, or its compiled twin, for a run of so many control periods."""
    dispatcher: Any = compiled(loop)
    if dispatcher is loop or not is_quicker(loop, periods, *arguments):
        return dispatcher  # type: ignore[no-any-return]
    types = tuple(map(dispatcher.typeof_pyval, arguments))
    file, total = _file(loop, types), _before(loop, types) + periods
    with contextlib.suppress(OSError):  # a read-only home: none is known of
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"{total:.0f}", "utf-8")
    return loop


def _before(loop: Callable[..., Any], types: tuple[Any, ...]) -> float:
    try:
        return float(_file(loop, types).read_text("utf-8"))
    except (OSError, ValueError):
        return 0.0


def _file(loop: Callable[..., Any], types: tuple[Any, ...]) -> Path:
    name = f"{loop.__module__}.{loop.__qualname__} {types}"
    return cache_folder() / "interpreted" / hashlib.sha256(name.encode()).hexdigest()[:16]
