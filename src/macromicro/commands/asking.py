"""Asking before a real machine moves."""

from __future__ import annotations

import sys

from macromicro.commands.signals import INTERRUPTED
from macromicro.errors import InputError

DECLINED = INTERRUPTED + 2  # as Ctrl-C: a person ended it


def agreed(what: str, *, yes: bool) -> None:
    """Say what is about to move, and wait for a person's yes.

    Parameters
    ----------
    what : str
        What will move, how far and how hard.
    yes : bool
        Whether the person said so beforehand (``--yes``).

    Raises
    ------
    InputError
        Nobody can be asked: standard input is no terminal.
    SystemExit
        The answer is no.
    """
    print(what, file=sys.stderr, flush=True)
    if yes:
        return
    if not sys.stdin.isatty():
        raise InputError("standard input", "no terminal", "--yes, to go on without being asked")
    print("Go on? [y/N] ", end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip().lower() not in ("y", "yes"):
        print("macromicro: nothing was moved", file=sys.stderr)
        raise SystemExit(DECLINED)
