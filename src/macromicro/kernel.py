"""The one place that knows the compiler.

``@kernel`` marks a plain Python function as part of the physics or the control
law. It stays a plain function: the live loop may call it interpreted. When
``compiled(function)`` is first asked for, numba is imported, every marked
function becomes callable from compiled code, and the result is cached on disk.

Kernels take and return floats, ints, ``NamedTuple``s of them and arrays. They use
``math`` only (never ``numpy`` functions), so that both ways of running give the
same bits.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

_waiting: list[Callable[..., Any]] = []
_register: Callable[[Callable[..., Any]], Any] | None = None
_KEPT_CACHES = 3


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Mark `function` as compilable and return it unchanged."""
    if _register is None:
        _waiting.append(function)
    else:
        _register(function)
    return function


def cache_folder() -> Path:
    """Folder of the compiler's cache: one per state of this package's sources.

    numba notices a change only in the file of the outermost function. An edit or an
    upgrade of a kernel that it calls would leave stale machine code behind, so the
    folder's name is a digest of all sources. ``MACROMICRO_CACHE`` moves its parent.
    """
    digest = hashlib.sha256()
    package = Path(__file__).parent
    for source in sorted(package.rglob("*.py")):
        digest.update(str(source.relative_to(package)).encode())
        digest.update(source.read_bytes())
    named = os.environ.get("MACROMICRO_CACHE")
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    parent = Path(named) if named else Path(home) / "macromicro"
    return parent / f"kernels-{digest.hexdigest()[:16]}"


def _drop_old_caches(current: Path) -> None:
    """Keep the newest few cache folders beside `current`, delete the others."""
    others = [p for p in current.parent.glob("kernels-*") if p.is_dir() and p != current]
    others.sort(key=lambda p: p.stat().st_mtime, reverse=True)
    for old in others[_KEPT_CACHES - 1 :]:
        shutil.rmtree(old, ignore_errors=True)


@cache
def _numba() -> Any:
    """Import numba, point its cache at our folder, register all waiting kernels."""
    global _register
    import numba
    from numba.extending import register_jitable

    try:
        folder = cache_folder()
        if not folder.exists():
            folder.mkdir(parents=True, exist_ok=True)
            _drop_old_caches(folder)
        numba.config.CACHE_DIR = str(folder)
    except OSError:
        # A read-only home: numba then tries its own places, or compiles every time.
        pass
    # Parameter sets have up to a hundred fields, which a call would copy one by one: inlined
    # everywhere, a control period of the whole bench takes a third less time.
    _register = register_jitable(forceinline=True)
    while _waiting:
        _register(_waiting.pop())
    return numba


@cache
def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The compiled twin of a kernel: same arguments, same result, machine speed.

    Division by zero follows IEEE (inf, nan) instead of raising; nothing is
    reassociated, so results equal the interpreted ones bit for bit.
    """
    numba = _numba()
    options: dict[str, Any] = {"nogil": True, "error_model": "numpy", "_nrt": False}
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no writable place for a cache
        dispatcher = numba.njit(**options)(function)
    result: Callable[P, R] = dispatcher
    return result
