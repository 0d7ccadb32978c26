"""What a loop process imports and compiles, for the process that is forked for each of them."""

from __future__ import annotations

import contextlib
import fcntl
import importlib
import tempfile
from collections.abc import Iterator
from pathlib import Path

from macromicro import kernel
from macromicro.rig.opening import TWIN
from macromicro.serve import loop_process
from macromicro.serve._launching import LIVE, Spec
from macromicro.serve.settings import LiveSettings


@contextlib.contextmanager
def compiling() -> Iterator[None]:
    """One process compiles at a time; the others then find its kernels in the cache."""
    lock = Path(tempfile.gettempdir(), f"{kernel.cache_folder().name}.lock")
    with lock.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


importlib.import_module("macromicro.serve.stage.opening")
with compiling():
    loop_process.open_machine(Spec(TWIN, 0, LiveSettings(), "warm", LIVE, 0)).warm()
