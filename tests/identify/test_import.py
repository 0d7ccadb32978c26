"""The room's front door: every public name loads, and nothing heavy before it is used."""

from __future__ import annotations

import subprocess
import sys

import pytest

from macromicro import identify


def test_every_public_name_loads() -> None:
    for name in identify._HOMES:
        assert getattr(identify, name) is not None
    assert set(identify._HOMES) <= set(dir(identify))
    with pytest.raises(AttributeError, match="frequency_response"):
        _ = identify.frequency_response


def test_functions_are_not_hidden_by_modules_of_their_name() -> None:
    for name in (
        "drive",
        "mls",
        "gls",
        "sriv",
        "least_squares",
        "output_error",
        "dead_zone",
        "plays",
    ):
        assert callable(getattr(identify, name))


def test_scipy_is_loaded_when_a_fit_needs_it() -> None:
    code = (
        "import sys; from macromicro.identify import mls, drive, dead_zone;"
        "sys.exit(any(m in sys.modules for m in ('scipy', 'numba', 'matplotlib')))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
