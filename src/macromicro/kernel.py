"""The interface to the compiler: ``@kernel`` marks functions, ``compiled`` compiles them.

Kernels take and return floats, ints, ``NamedTuple``s of them and arrays, and use ``math`` only,
so that they give the same bits interpreted.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any, ParamSpec, TypeVar
from weakref import WeakSet

P = ParamSpec("P")
R = TypeVar("R")

_waiting: list[Callable[..., Any]] = []
_marked: WeakSet[Callable[..., Any]] = WeakSet()
_chosen: list[tuple[Callable[..., Any], Callable[..., Any]]] = []  # see `by_type`
_joined: dict[str, str] = {}  # laws of other packages: name, digest of their sources
_register: Callable[[Callable[..., Any]], Any] | None = None
# Parameter sets have up to a hundred fields, which a call would copy one by one: inlined
# everywhere, a control period of the whole bench takes a third less time.
# Nothing but compiled code calls what is inlined: it needs no entries from Python and C, and no
# machine code of its own.
_INLINED = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
# What old caches may take: several checkouts and environments live side by side, each with a
# folder of some megabytes that it renews at every start.
_CACHE_DAYS = 30.0
_CACHE_BYTES = 512 * 2**20
# Rooms whose edits leave every kernel as it is: they hold none, nor what one is made of.
_NO_KERNELS = (
    "commands", "drawing", "export", "files", "remote", "report", "robustness", "serve", "sweeps",
)  # fmt: skip
_IN_USE = 3600.0  # s: a process that began so short a time ago may still read its folder


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """Mark a function as compilable.

    Parameters
    ----------
    function : Callable[P, R]
        Takes and returns floats, ints, arrays and ``NamedTuple``s of them, with ``math`` only.

    Returns
    -------
    Callable[P, R]
        The same function, unchanged.

    Examples
    --------
    >>> from macromicro.kernel import is_kernel, kernel
    >>> @kernel
    ... def spring(stiffness: float, x: float) -> float:
    ...     return -stiffness * x
    >>> spring(2000.0, 0.001), is_kernel(spring)
    (-2.0, True)
    """
    _marked.add(function)
    if _register is None:
        _waiting.append(function)
    else:
        _register(function)
    return function


def is_kernel(function: object) -> bool:
    """Whether a function is marked as compilable.

    Parameters
    ----------
    function : object
        Anything.

    Returns
    -------
    bool
        True for what `kernel` was given.

    Examples
    --------
    >>> from macromicro.hysteresis import fresh, lookup
    >>> from macromicro.kernel import is_kernel
    >>> is_kernel(lookup), is_kernel(fresh)
    (True, False)
    """
    return callable(function) and function in _marked


def foreign() -> set[Path]:
    """Files outside this package that hold kernels.

    Returns
    -------
    set[Path]
        Of those marked so far.

    Examples
    --------
    >>> from pathlib import Path
    >>> from macromicro import kernel
    >>> Path(kernel.__file__) in kernel.foreign()
    False
    """
    files = {Path(function.__code__.co_filename) for function in _marked}
    package = Path(__file__).parent
    return {file for file in files if package not in file.parents and file.is_file()}


def by_type(choose: Callable[..., Any]) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorator of a function that kernels may call and whose implementation depends on types.

    Parameters
    ----------
    choose : Callable[..., Any]
        From the compiler's types of the arguments (`instance_class` is the class of a
        ``NamedTuple``'s) to the function that stands for it: a plain one with the same names of
        arguments, which may call kernels.

    Returns
    -------
    Callable[[Callable[P, R]], Callable[P, R]]
        The decorator; interpreted, the function is what it is.
    """

    def marked(function: Callable[P, R]) -> Callable[P, R]:
        _chosen.append((function, choose))
        if _register is not None:  # numba is loaded already and will not ask again
            _overload(function, choose)
        return function

    return marked


def admit(name: str, digest: str) -> None:
    """Admit kernels of another package; later compilations are cached beside them.

    An edit of their sources makes another folder. The folder of this package's own kernels never
    holds types of other packages, which other processes may be unable to import.

    Parameters
    ----------
    name : str
        What joins.
    digest : str
        Of the sources that it is compiled from.
    """
    _joined[name] = digest
    if _register is not None:
        _point(_numba())


def cache_folder(joined: bool = True) -> Path:
    """Folder of the compiler's cache: one per state of this package's sources and compiler.

    numba notices a change only in the file of the outermost function. An edit or an
    upgrade of a kernel that it calls would leave stale machine code behind, and two
    versions of numba would overwrite each other's index for ever; so the folder's name is
    a digest of what kernels are made of and of what compiles them. The rooms of `_NO_KERNELS`
    do not count. ``MACROMICRO_CACHE`` moves its parent.

    Parameters
    ----------
    joined : bool, optional
        Whether kernels of other packages count (`admit`).

    Returns
    -------
    Path
        The folder, which need not exist yet.
    """
    named = os.environ.get("MACROMICRO_CACHE")
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    parent = Path(named) if named else Path(home) / "macromicro"
    digest = hashlib.sha256(_own_sources())
    digest.update(f"{sys.implementation.cache_tag} {sys.version}".encode())
    for distribution in ("numba", "llvmlite", "numpy"):
        try:
            digest.update(metadata.version(distribution).encode())
        except metadata.PackageNotFoundError:  # without a compiler nothing is cached either
            digest.update(b"none")
    for name, sources in sorted(_joined.items()) if joined else ():
        digest.update(f"{name} {sources}".encode())
    return parent / f"kernels-{digest.hexdigest()[:16]}"


@cache
def _own_sources() -> bytes:
    """Digest of this package's files that kernels may be made of."""
    package, digest = Path(__file__).parent, hashlib.sha256()
    for folder, within, names in os.walk(package):
        if Path(folder) == package:
            within[:] = [name for name in within if name not in _NO_KERNELS]
        within.sort()
        for source in (Path(folder) / name for name in sorted(names) if name.endswith(".py")):
            digest.update(str(source.relative_to(package)).encode())
            digest.update(hashlib.sha256(source.read_bytes()).digest())
    return digest.digest()


@contextlib.contextmanager
def counting(report: Callable[[int], None]) -> Iterator[None]:
    """Report the number of kernels compiled so far, after each.

    Parameters
    ----------
    report : Callable[[int], None]
        Is called with the number.

    Yields
    ------
    None
        While kernels are counted.

    Examples
    --------
    >>> from macromicro.kernel import compiled, counting
    >>> counts = []
    >>> with counting(counts.append):
    ...     _ = compiled(lambda x: 2.0 * x)(1.0)
    >>> counts
    [1]
    """
    _numba()
    from numba.core import event

    count = 0

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: Any) -> None:
            pass

        def on_end(self, event: Any) -> None:
            nonlocal count
            count += 1
            report(count)

    with event.install_listener("numba:compile", Listener()):
        yield


def _size(folder: Path) -> int:
    """Bytes of all files in a folder; vanishing files count as 0."""
    total = 0
    for place, _, names in os.walk(folder):
        for name in names:
            try:
                total += (Path(place) / name).stat().st_size
            except OSError:
                continue
    return total


def _drop_old_caches(current: Path) -> None:
    """Delete cache folders by age of last use and by size, never one that may be in use."""
    now = current.stat().st_mtime  # just renewed
    others = []
    for place in current.parent.glob("kernels-*"):
        try:
            if place.is_dir() and place != current:
                others.append((now - place.stat().st_mtime, place))
        except OSError:
            continue
    kept = _size(current)
    for age, place in sorted(others):
        kept += _size(place)
        if age > _IN_USE and (age > _CACHE_DAYS * 86400.0 or kept > _CACHE_BYTES):
            shutil.rmtree(place, ignore_errors=True)


@cache
def _numba() -> Any:
    """Import numba, set its cache folder, register all waiting kernels."""
    global _register
    import numba
    from numba.core import event
    from numba.extending import register_jitable

    event.register("numba:compile", _without_collector(event.Listener))
    _point(numba)
    _register = register_jitable(**_inlined())
    while _waiting:
        _register(_waiting.pop())
    for function, choose in _chosen:
        _overload(function, choose)
    return numba


def _inlined() -> dict[str, Any]:
    """The compiler's options for kernels that are inlined."""
    from macromicro._parts import Parts

    return {**_INLINED, "pipeline_class": Parts}


def _without_collector(listener: Any) -> Any:
    """What switches the garbage collector off while the compiler works.

    The compiler makes millions of objects that stay until it has ended, and looking through them
    again and again takes a tenth of its time; the collector finds them among the old ones later.
    It is told of each kernel, with those that it calls within, and works in one thread at a time.
    """

    class Collector(listener):  # type: ignore[misc]
        depth, collects = 0, False

        def on_start(self, event: Any) -> None:
            if self.depth == 0:
                self.collects = gc.isenabled()
                gc.disable()
            self.depth += 1

        def on_end(self, event: Any) -> None:
            self.depth -= 1
            if self.depth == 0 and self.collects:
                gc.freeze()
                gc.unfreeze()  # all are old now: the next collection of young ones is a short one
                gc.enable()

    return Collector()


def _overload(function: Callable[..., Any], choose: Callable[..., Any]) -> None:
    """Let compiled code call the function that stands for another one."""
    from numba.extending import overload

    overload(function, jit_options=_inlined(), strict=False)(choose)


def _fill(folder: Path) -> None:
    """Link this package's compiled kernels into the new folder of a joined law.

    A law brings types of its own, so it adds machine code and changes none; and the compiler
    replaces files as a whole, so the links of one folder do not reach the other.
    """
    own = cache_folder(joined=False)
    if own == folder:
        return
    for place, within, names in os.walk(own):
        within[:] = [name for name in within if name != "interpreted"]
        beside = folder / Path(place).relative_to(own)
        beside.mkdir(exist_ok=True)
        for name in names:
            with contextlib.suppress(OSError):  # gone meanwhile, or no links here: it is compiled
                os.link(Path(place) / name, beside / name)


def _point(numba: Any) -> None:
    """Set the cache folder of later compilations."""
    try:
        folder = cache_folder()
        new = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        os.utime(folder)
        if new:
            _fill(folder)
            _drop_old_caches(folder)
        numba.config.CACHE_DIR = str(folder)
    except OSError:
        # A read-only home: numba then tries its own places, or compiles every time.
        pass


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """The compiled twin of a kernel: same arguments, same result, machine speed.

    Division by zero follows IEEE (inf, nan) instead of raising; nothing is
    reassociated, so results equal the interpreted ones bit for bit.

    Parameters
    ----------
    function : Callable[P, R]
        A plain function; the kernels that it calls are marked with `kernel`.

    Returns
    -------
    Callable[P, R]
        The compiled function, or one that compiles at its first call.
    """
    return _compiled(function, tuple(sorted(_joined)))


@cache
def _compiled(function: Callable[P, R], joined: tuple[str, ...]) -> Callable[P, R]:
    """`compiled`, once for each set of joined laws."""
    numba = _numba()
    # Kernels never allocate, so numba need not count references to their arrays: that halves
    # the micro-stage's period. `_nrt` is numba's own option; tests/test_kernel.py says what to
    # do in the version that drops it.
    from macromicro._parts import Whole

    options: dict[str, Any] = {
        "nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True,
        "pipeline_class": Whole,
    }  # fmt: skip
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
    except RuntimeError:  # no writable place for a cache
        dispatcher = numba.njit(**options)(function)
    result: Callable[P, R] = dispatcher
    return result


def choice(function: object) -> Callable[..., Any] | None:
    """What chooses the function that stands for another one (`by_type`).

    Parameters
    ----------
    function : object
        Anything.

    Returns
    -------
    Callable[..., Any] | None
        As `by_type` was given it; None for what it did not mark.

    Examples
    --------
    >>> from macromicro.hysteresis import lookup
    >>> from macromicro.kernel import choice
    >>> choice(lookup) is None
    True
    """
    return next((choose for marked, choose in _chosen if marked is function), None)


def marked() -> tuple[Callable[..., Any], ...]:
    """All kernels that have been imported.

    Returns
    -------
    tuple[Callable[..., Any], ...]
        Unordered.

    Examples
    --------
    >>> from macromicro.hysteresis import lookup
    >>> from macromicro.kernel import marked
    >>> lookup in marked()
    True
    """
    return tuple(_marked)
