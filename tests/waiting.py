"""Waits of tests: each ends, and says what it waited for."""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from typing import Any

PATIENCE_S = 60.0
LOOK_S = 0.01  # between two looks


def until(what: Callable[[], Any], patience: float = PATIENCE_S) -> Any:
    """The first true value of `what`; the test fails where it never comes."""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        found = what()
        if found:
            return found
        time.sleep(LOOK_S)
    raise AssertionError(f"not within {patience:g} s: {_words(what)}")


def _words(what: Callable[[], Any]) -> str:
    try:
        return " ".join(inspect.getsource(what).split())
    except (OSError, TypeError):
        return repr(what)
