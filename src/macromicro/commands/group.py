"""What the commands share: the group, whole numbers, a remark on laws in plain Python."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from typer import BadParameter
from typer.core import TyperGroup

from macromicro.errors import InputError
from macromicro.schema.text import printable


def tell(chosen: Any) -> None:
    """Remark on a law in plain Python of the two-stage machine."""
    from macromicro.control import settings

    controller = getattr(chosen, "controller", None)  # none of several stages
    if isinstance(controller, settings.Control) and not settings.prepare(controller).compiles:
        words = "is plain Python: it runs interpreted, slower; `start` and `step` under @kernel"
        print(f"{controller.macro_law} {words} are compiled", file=sys.stderr)


def announce_compiling(is_compiled: bool) -> None:
    if not is_compiled:
        print("compiling the machine, once, about 5 s", file=sys.stderr, flush=True)


@contextmanager
def compiling(is_compiled: bool) -> Iterator[None]:
    """Announce that the block compiles, and count the kernels in a terminal."""
    announce_compiling(is_compiled)
    if is_compiled or not sys.stderr.isatty():
        yield
        return
    from macromicro import kernel
    from macromicro.drawing.console import progress_bar

    with progress_bar("{task.completed:.0f} kernels") as bar:
        task = bar.add_task("compiled", total=None)
        with kernel.counting(lambda count: bar.update(task, completed=count)):
            yield


class Group(TyperGroup):
    """A group that names its commands in the error for an unknown one."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.commands and not cmd_name.startswith("-"):
            names = ", ".join(self.commands)
            raise InputError(ctx.info_name or "command", printable(cmd_name), f"one of {names}")
        return super().get_command(ctx, cmd_name)


def whole(text: str | int) -> int:
    """Parse a whole number; the message names the value, unlike typer's own."""
    try:
        return int(text)
    except ValueError:
        raise BadParameter(f"{text!r}; accepted: a whole number") from None


def check_ports(ports: Mapping[str, int]) -> None:
    """Refuse numbers that are no ports; by option."""
    for option, port in ports.items():
        if not -1 <= port <= 65535:
            accepted = "a port from 1 to 65535, 0 for any free one, -1 for none"
            raise InputError(option, port, accepted)
