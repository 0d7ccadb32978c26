"""Marks of tests that not every system can run."""

from __future__ import annotations

import os
import sys

import pytest

_POSIX = "needs POSIX: signals to processes, terminals, special files"
posix = pytest.mark.skipif(os.name != "posix", reason=_POSIX)
linux = pytest.mark.skipif(
    sys.platform != "linux", reason="needs Linux: /proc, /dev/full, its scheduler"
)


def require_posix() -> None:
    """Skip the test that calls this, by way of a helper that needs what `posix` needs."""
    if os.name != "posix":
        pytest.skip(_POSIX)
