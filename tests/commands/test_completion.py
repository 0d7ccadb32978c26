"""Completion in a shell, as the shell asks for it."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from macromicro import programme

TRIES = {
    "re": {"reproduce", "response"},
    "identify dr": {"drive"},
    "identify drive --col": {"--columns"},
    "config show --mac": {"--machine"},
    "run --out run --ove": {"--overwrite"},
    "run thes": {"thesis"},
    "programmes ": set(programme.shipped()),
    "--ver": {"--version"},
    "robust nothing-such": set(),
}


@pytest.mark.parametrize("words", TRIES)
def test_bash_completes_commands_options_and_programmes(words: str) -> None:
    typed = f"macromicro {words}"
    asked = {
        "_MACROMICRO_COMPLETE": "complete_bash",
        "COMP_WORDS": typed,
        "COMP_CWORD": str(typed.count(" ")),
    }
    done = subprocess.run(
        [sys.executable, "-m", "macromicro"],
        env={**os.environ, **asked},
        capture_output=True,
        text=True,
        check=True,
    )
    assert set(done.stdout.split()) == TRIES[words]
