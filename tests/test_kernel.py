"""Kernels: one function, run interpreted and compiled, with a cache that never goes stale."""

import gc
import math
import os
import shutil
import struct
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import macromicro
from macromicro import kernel as room
from macromicro.kernel import by_type, compiled, kernel
from tests.systems import posix

PACKAGE = Path(macromicro.__file__).parent


class Pendulum(NamedTuple):
    """Parameters of the toy plant."""

    rate: float
    friction: float


class Swing(NamedTuple):
    """State of the toy plant: a nested set and a counter."""

    angle: float
    speed: float
    steps: int


class Pair(NamedTuple):
    """Two swings in one state."""

    left: Swing
    right: Swing


@kernel
def torque(par: Pendulum, swing: Swing, push: float) -> float:
    drag = par.friction * math.tanh(10.0 * swing.speed)
    return push - par.rate * par.rate * math.sin(swing.angle) - drag


@kernel
def step(par: Pendulum, swing: Swing, push: float, dt: float) -> Swing:
    speed = (swing.speed + torque(par, swing, push) * dt) * math.exp(-0.1 * dt)
    angle = math.atan2(math.sin(swing.angle + speed * dt), math.cos(swing.angle + speed * dt))
    return Swing(angle, speed, swing.steps + 1)


@kernel
def step_pair(par: Pendulum, pair: Pair, push: float, dt: float) -> Pair:
    left = step(par, pair.left, push, dt)
    return Pair(left, step(par, pair.right, left.angle, dt))


@kernel
def rollout(par: Pendulum, pair: Pair, pushes: np.ndarray, out: np.ndarray, dt: float) -> Pair:
    for i in range(pushes.size):
        pair = step_pair(par, pair, pushes[i], dt)
        out[i] = pair.right.angle
    return pair


@kernel
def ratio(a: float, b: float) -> float:
    return a / b


def bits(value: float) -> bytes:
    """The eight bytes of a float, so that -0.0 and 0.0 differ."""
    return struct.pack("d", value)


small = st.floats(-50.0, 50.0)
START = Pair(Swing(0.1, 0.0, 0), Swing(-0.2, 0.5, 0))


def test_a_marked_function_stays_a_plain_function() -> None:
    def plain(x: float) -> float:
        return x

    assert kernel(plain) is plain


def test_compiled_is_made_once() -> None:
    assert compiled(step) is compiled(step)
    assert compiled(step) is not step


@settings(max_examples=50, deadline=None)  # the first example compiles
@given(rate=small, friction=small, angle=small, speed=small, push=small)
def test_interpreted_and_compiled_give_the_same_bits(
    rate: float, friction: float, angle: float, speed: float, push: float
) -> None:
    par, swing = Pendulum(rate, friction), Swing(angle, speed, 3)
    slow, fast = step(par, swing, push, 1e-3), compiled(step)(par, swing, push, 1e-3)
    assert bits(slow.angle) == bits(fast.angle)
    assert bits(slow.speed) == bits(fast.speed)
    assert slow.steps == fast.steps == 4


def test_nested_kernels_sets_and_arrays_over_many_steps() -> None:
    par = Pendulum(3.0, 0.2)
    pushes = np.sin(np.arange(2000) * 0.01)
    slow_out, fast_out = np.empty(pushes.size), np.empty(pushes.size)
    slow = rollout(par, START, pushes, slow_out, 1e-3)
    fast = compiled(rollout)(par, START, pushes, fast_out, 1e-3)
    assert slow == fast
    assert isinstance(fast, Pair)
    assert isinstance(fast.left, Swing)
    assert np.array_equal(slow_out, fast_out)
    assert np.ptp(slow_out) > 0.1


@pytest.mark.parametrize("before", [True, False])
def test_the_compiler_works_without_a_garbage_collector_and_leaves_it_as_it_was(
    before: bool,
) -> None:
    collects = []

    def chosen(x: Any) -> Any:
        collects.append(gc.isenabled())
        return lambda x: x + 1.0

    @by_type(chosen)
    def more(x: float) -> float:
        return x + 1.0

    def twice_more(x: float) -> float:
        return more(more(x))

    def absurd(x: float) -> float:
        return more(x) + "text"  # type: ignore[operator]

    (gc.enable if before else gc.disable)()
    try:
        assert compiled(twice_more)(1.0) == 3.0
        with pytest.raises(Exception, match="unicode_type"):
            compiled(absurd)(1.0)
        assert gc.isenabled() is before
    finally:
        gc.enable()
    assert collects and not any(collects)


def test_a_kernel_marked_after_the_compiler_was_loaded_can_be_called() -> None:
    compiled(step)

    @kernel
    def double(x: float) -> float:
        return 2.0 * x

    @kernel
    def fourfold(x: float) -> float:
        return double(double(x))

    assert compiled(fourfold)(1.5) == 6.0


def test_compiled_division_by_zero_follows_ieee() -> None:
    assert compiled(ratio)(1.0, 0.0) == math.inf
    assert compiled(ratio)(-1.0, 0.0) == -math.inf
    assert math.isnan(compiled(ratio)(0.0, 0.0))
    with pytest.raises(ZeroDivisionError):
        ratio(1.0, 0.0)


def run(script: str, package: Path = PACKAGE, **environment: str) -> str:
    """What `script` prints in a fresh interpreter that uses `package`."""
    environment = os.environ | {"PYTHONPATH": str(package.parent)} | environment
    done = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A small copy of the package that a test may change."""
    package = tmp_path / "site" / "macromicro"
    package.mkdir(parents=True)
    for name in ("__init__", "kernel", "errors", "interpreting", "_parts", "lazy"):
        shutil.copy(PACKAGE / f"{name}.py", package / f"{name}.py")
    (package / "plant").mkdir()
    (package / "plant" / "part.py").write_text("GAIN = 2.0\n")
    return package


WHERE = "from macromicro.kernel import cache_folder; print(cache_folder())"


def test_cache_folder_depends_on_the_code_of_every_source(copy: Path) -> None:
    first = run(WHERE, copy)
    assert run(WHERE, copy) == first
    part = copy / "plant" / "part.py"
    seen = {first}
    for text in ("GAIN = 2.1\n", "GAIN = 2.15\n"):
        part.write_text(text)
        seen.add(run(WHERE, copy))
    part.rename(part.with_name("other.py"))
    seen.add(run(WHERE, copy))
    assert len(seen) == 4
    part.with_name("other.py").rename(part)
    part.write_text("GAIN = 2.0\n")
    assert run(WHERE, copy) == first


def test_cache_folder_ignores_what_no_kernel_is_made_of(copy: Path) -> None:
    first = run(WHERE, copy)
    (copy / "notes.txt").write_text("x")
    (copy / "serve").mkdir()
    (copy / "serve" / "page.py").write_text("TITLE = 'page'\n")
    assert run(WHERE, copy) == first


EVERY_KERNEL = """
import importlib, pkgutil, types
import macromicro
from macromicro import kernel

def names(code):
    nested = [c for c in code.co_consts if isinstance(c, types.CodeType)]
    return {*code.co_names, *(n for c in nested for n in names(c))}

for found in pkgutil.walk_packages(macromicro.__path__, "macromicro."):
    if not any(part in found.name for part in ("__main__", "ophyd", "serve", "remote")):
        importlib.import_module(found.name)
rooms = set()
for function in kernel.marked():
    rooms.add(function.__module__)
    for name in names(function.__code__):
        value = function.__globals__.get(name)
        rooms.add(getattr(value, "__module__", None) or getattr(value, "__name__", ""))
print(*sorted({room.split(".")[1] for room in rooms if room.startswith("macromicro.")}))
"""


def test_no_kernel_is_made_of_what_the_cache_ignores() -> None:
    rooms = run(EVERY_KERNEL).split()
    assert {"plant", "control", "machines"} <= set(rooms)
    assert not set(rooms) & set(room._NO_KERNELS)


def test_cache_folder_can_be_moved(
    copy: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    monkeypatch.delenv("MACROMICRO_CACHE", raising=False)
    assert Path(run(WHERE, copy)).parent == tmp_path / "xdg" / "macromicro"
    monkeypatch.setenv("MACROMICRO_CACHE", str(tmp_path / "mine"))
    assert Path(run(WHERE, copy)).parent == tmp_path / "mine"


LEAF = "from macromicro.kernel import kernel\n@kernel\ndef leaf(x):\n    return x * {gain}\n"
ROOT = """
from macromicro.kernel import by_type, compiled, kernel
from macromicro.leaf import leaf
@kernel
def root(x):
    return leaf(x) + 1.0
"""
CALL = "from macromicro.root import root, compiled; print(compiled(root)(10.0))"


def test_a_second_process_takes_the_machine_code_from_the_cache_until_a_callee_changes(
    copy: Path, tmp_path: Path
) -> None:
    """The compiler's own check would look at root.py alone."""
    cache = str(tmp_path / "cache")
    (copy / "root.py").write_text(ROOT)
    (copy / "leaf.py").write_text(LEAF.format(gain="2.0"))
    hits = CALL + "; print(sum(compiled(root).stats.cache_hits.values()))"
    assert run(hits, copy, MACROMICRO_CACHE=cache).split() == ["21.0", "0"]
    assert list(Path(cache).glob("kernels-*/**/*.nbc")), "nothing was cached"
    assert run(hits, copy, MACROMICRO_CACHE=cache).split() == ["21.0", "1"]
    (copy / "leaf.py").write_text(LEAF.format(gain="3.0"))
    assert run(hits, copy, MACROMICRO_CACHE=cache).split() == ["31.0", "0"]


USED = "from macromicro.kernel import _numba; print(_numba().config.CACHE_DIR)"


DAY = 86400.0


def old_cache(parent: Path, name: str, age: float, size: int = 0) -> Path:
    """A cache folder last used `age` [s] ago; its file takes no disk, whatever its size."""
    folder = parent / f"kernels-{name}"
    (folder / "inside").mkdir(parents=True)
    with (folder / "inside" / "code.nbc").open("wb") as file:
        file.truncate(size)
    then = time.time() - age
    os.utime(folder, (then, then))
    return folder


def test_caches_are_dropped_by_age_of_last_use(copy: Path, tmp_path: Path) -> None:
    """Ten checkouts side by side keep theirs, a month later unused ones are gone."""
    cache = tmp_path / "cache"
    fresh = {old_cache(cache, f"{k}", k * 2.9 * DAY).name for k in range(10)}
    stale = old_cache(cache, "stale", 31 * DAY)
    (cache / "kept").mkdir()
    used = Path(run(USED, copy, MACROMICRO_CACHE=str(cache)))
    assert used.parent == cache
    assert {p.name for p in cache.iterdir() if p.is_dir()} == {used.name, "kept", *fresh}
    assert not stale.exists()


def test_caches_are_dropped_by_size_oldest_first(copy: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    young = old_cache(cache, "young", 0.1 * DAY, 300 * 2**20)
    old = old_cache(cache, "old", 2 * DAY, 300 * 2**20)
    run(USED, copy, MACROMICRO_CACHE=str(cache))
    assert young.exists()
    assert not old.exists()


def test_a_cache_that_may_be_in_use_is_never_dropped(copy: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    large = [old_cache(cache, f"{k}", 60.0 * k, 400 * 2**20) for k in range(3)]
    run(USED, copy, MACROMICRO_CACHE=str(cache))
    assert all(folder.exists() for folder in large)


def test_use_renews_a_cache(copy: Path, tmp_path: Path) -> None:
    """Else the folder of a package that nobody edits would be dropped while it is in use."""
    cache = tmp_path / "cache"
    used = Path(run(USED, copy, MACROMICRO_CACHE=str(cache)))
    os.utime(used, (1e9, 1e9))
    run(USED, copy, MACROMICRO_CACHE=str(cache))
    assert time.time() - used.stat().st_mtime < 600.0


@pytest.mark.parametrize("package", ["numba", "numpy"])
def test_another_compiler_has_another_cache(copy: Path, package: str) -> None:
    """Two versions of numba would overwrite each other's index at every start."""
    script = (
        "from importlib import metadata\n"
        "true = metadata.version\n"
        f"metadata.version = lambda name: '0.1' if name == {package!r} else true(name)\n"
    )
    assert run(script + WHERE, copy) != run(WHERE, copy)


SOON = """
from macromicro import interpreting, kernel
from macromicro.root import root
print(interpreting.is_quicker(root, 10.0, 2.0), kernel.compiled(root).signatures)
"""


def test_what_is_cached_is_not_interpreted(copy: Path, tmp_path: Path) -> None:
    """By numba's cache of a function, which has no public door: if this fails after an upgrade,
    see in numba's caching.py what tells whether a signature is cached."""
    cache = str(tmp_path / "cache")
    (copy / "root.py").write_text(ROOT)
    (copy / "leaf.py").write_text(LEAF.format(gain="2.0"))
    assert run(SOON, copy, MACROMICRO_CACHE=cache) == "True []"
    run(CALL, copy, MACROMICRO_CACHE=cache)
    assert run(SOON, copy, MACROMICRO_CACHE=cache) == "False []"
    other = SOON.replace("2.0)", "2)")
    assert run(other, copy, MACROMICRO_CACHE=cache) == "True []"  # of integers there is none
    many = SOON.replace("10.0", "40_000")
    assert run(many, copy, MACROMICRO_CACHE=str(tmp_path / "none")) == "False []"


def test_a_switched_off_compiler_is_not_waited_for(copy: Path) -> None:
    (copy / "root.py").write_text(ROOT)
    (copy / "leaf.py").write_text(LEAF.format(gain="2.0"))
    code = """
from macromicro import interpreting
from macromicro.root import root
print(interpreting.is_quicker(root, 40_000, 2.0), interpreting.quickest(root, 40_000, 2.0) is root)
"""
    assert run(code, copy, NUMBA_DISABLE_JIT="1") == "True True"


def test_numba_still_knows_the_private_option_nrt() -> None:
    """`_nrt=False` is no public option of numba: kernels allocate nothing, and without reference
    counts the micro-stage's period takes half the time.

    Where this fails after an upgrade of numba: drop the option from `kernel.compiled`, run
    `make bench`, and note the loss of speed (factor 2 in the micro tick) in
    docs/validation/performance.md; results do not change. Look for a public successor first.
    """
    import numba
    from numba.core.errors import NumbaError

    def total(values):
        return values[0] + values[-1]

    def allocate(count):
        return np.ones(count).sum()

    lean = numba.njit(_nrt=False)(total)
    assert lean(np.arange(3.0)) == 2.0
    assert lean.targetoptions["_nrt"] is False
    # The option is obeyed, not only taken: nothing can be allocated without reference counts.
    assert numba.njit(allocate)(3) == 3.0
    with pytest.raises(NumbaError):
        numba.njit(_nrt=False)(allocate)(3)


def test_only_the_outermost_kernel_is_made_machine_code() -> None:
    """`_parts` takes numba's compiler to pieces that are not public: it saves a fifth of the time
    to compile a machine.

    Where this fails after an upgrade of numba: drop `_parts` and the options of `kernel` that
    name it; results do not change. Look for a public successor first.
    """
    from numba.core import event

    @kernel
    def inner(x: float) -> float:
        return 2.0 * x + 1.0

    def outer(x: float) -> float:
        return inner(x) * inner(x - 1.0)

    lowered = {}

    class Listener(event.Listener):
        def on_start(self, event: Any) -> None:
            step = event.data["name"].split()[0]
            if step.endswith("_lowering"):
                lowered[event.data["qualname"].split(".")[-1]] = step

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:run_pass", Listener()):
        assert compiled(outer)(0.3) == outer(0.3)
    assert lowered == {"inner": "part_lowering", "outer": "whole_lowering"}


def test_a_kernel_may_print_and_raise_inside_another(capfd: pytest.CaptureFixture[str]) -> None:
    @kernel
    def inner(x: float) -> float:
        print("x is", x)
        if x < 0.0:
            raise ValueError("x is negative")
        return x

    def outer(x: float) -> float:
        return inner(x) + 1.0

    assert compiled(outer)(2.0) == 3.0
    assert capfd.readouterr().out == "x is 2.0\n"
    with pytest.raises(ValueError, match="x is negative"):
        compiled(outer)(-1.0)


def test_two_processes_that_start_at_once_share_the_cache(copy: Path, tmp_path: Path) -> None:
    """The folder appears after this process found it missing: still the folder to use."""
    late = (
        "from pathlib import Path\n"
        "from macromicro.kernel import cache_folder\n"
        "cache_folder().mkdir(parents=True)\n"
        "Path.exists = lambda self, **kw: False\n"
    )
    cache = tmp_path / "cache"
    used = run(late + USED, copy, MACROMICRO_CACHE=str(cache))
    assert used == run(WHERE, copy, MACROMICRO_CACHE=str(cache))


@posix
@pytest.mark.parametrize("obstacle", [pytest.param("a file", marks=pytest.mark.slow), "read-only"])
def test_no_place_for_a_cache_costs_only_time(copy: Path, tmp_path: Path, obstacle: str) -> None:
    cache = tmp_path / "cache"
    if obstacle == "a file":
        cache.write_text("")
    else:
        cache.mkdir()
        cache.chmod(0o500)
    (copy / "root.py").write_text(ROOT)
    (copy / "leaf.py").write_text(LEAF.format(gain="2.0"))
    assert run(CALL, copy, MACROMICRO_CACHE=str(cache)) == "21.0"


def test_what_is_chosen_by_type_may_be_imported_after_numba() -> None:
    """A module that is first imported when something else has been compiled already."""
    assert compiled(math_only)(4.0) == 2.0

    @room.by_type(lambda p: math_only if p.name == "float64" else None)
    def late(p: float) -> float:
        return -1.0

    @kernel
    def caller(p: float) -> float:
        return late(p) + 1.0

    assert (caller(9.0), compiled(caller)(9.0)) == (0.0, 4.0)


@kernel
def math_only(p: float) -> float:
    return math.sqrt(p)
