"""Confirmation before a rig of the user's moves."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from macromicro.errors import ProblemError

OPTION = "--yes"


def stepwise(rig: str, *, yes: bool) -> Callable[[str, str], None]:
    """Ask before each step of a procedure."""
    return lambda title, intent: confirm([f"{title}: {intent}"], f"--rig {rig}", yes=yes)


def confirm(lines: list[str], where: str, *, yes: bool) -> None:
    """Say what is about to move and ask for confirmation, unless `yes`."""
    print(*lines, sep="\n", file=sys.stderr, flush=True)
    if yes:
        return
    check_terminal(where)
    print("move it? [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        raise ProblemError(where, "not confirmed", f"Answer y, or add {OPTION}.")


def check_terminal(where: str) -> None:
    """Refuse to go on where no terminal asks for confirmation."""
    if not sys.stdin.isatty():
        found = "confirmation needed, but standard input is not a terminal"
        raise ProblemError(where, found, f"Add {OPTION}.")


def before(job: Any, yes: bool) -> None:
    """Ask before a run on the user's rig."""
    if lines := job.setup.intent(job.source):
        confirm(lines, f"--rig {job.request.rig}", yes=yes)
