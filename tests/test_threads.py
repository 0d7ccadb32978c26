"""Threads of linear algebra."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from macromicro import threads

# The command, cut short after its options: what its commands find in the environment.
SCRIPT = """
import os, sys
import macromicro.cli as cli
show = lambda prog_name: print("numpy" in sys.modules, *(os.environ.get(n) for n in %r))
cli.command_line = lambda: show
sys.exit(cli.main())
"""


@pytest.mark.parametrize("own", [{}, {"OPENBLAS_NUM_THREADS": "3"}])
def test_the_command_takes_one_thread_unless_the_user_says_otherwise(own: dict[str, str]) -> None:
    """Set before numpy is there, which reads it as it is imported."""
    clean = {k: v for k, v in os.environ.items() if k not in threads.BLAS}
    script = SCRIPT % (threads.BLAS,)
    done = subprocess.run(
        [sys.executable, "-c", script], env=clean | own, capture_output=True, text=True, check=True
    )
    expected = [own.get(name, "1") for name in threads.BLAS]
    assert done.stdout.split() == ["False", *expected]
