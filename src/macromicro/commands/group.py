"""A group of commands that says, for an unknown one, which there are."""

from __future__ import annotations

from typing import Any

from typer.core import TyperGroup

from macromicro.errors import InputError
from macromicro.schema.text import printable


class Group(TyperGroup):
    """Raises `InputError` for a command that is none of the group's."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command named `cmd_name`."""
        if cmd_name not in self.commands and not cmd_name.startswith("-"):
            names = ", ".join(self.commands)
            raise InputError(ctx.info_name or "command", printable(cmd_name), f"one of {names}")
        return super().get_command(ctx, cmd_name)
