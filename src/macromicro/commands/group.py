"""What the commands share: a group that names its commands, an option of a whole number,
the option --figures."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import BadParameter, Option
from typer.core import TyperGroup

from macromicro.errors import InputError
from macromicro.schema.text import printable

if TYPE_CHECKING:
    from macromicro.control.settings import Control

Figures = Annotated[
    str,
    Option(
        "--figures",
        metavar="FORMATS",
        help="Formats of the figures: png, svg, pdf, or several, as svg,pdf.",
    ),
]
PNG = "png"
Law = Annotated[
    str | None,
    Option(
        "--law",
        metavar="NAME",
        help="Control law: of the macro-stage, of the micro-stage, or of both with a comma; "
        "or MODULE:LAW of your own (docs/laws.md).",
        show_default="that of the settings",
    ),
]
Port = Annotated[
    str | None,
    Option(
        "--port",
        metavar="DEVICE",
        help="Serial port of --rig board (docs/firmware.md).",
        show_default=False,
    ),
]
Loop = Annotated[
    str | None,
    Option(
        "--loop",
        metavar="WHO",
        help="Who closes the loop of --rig board: board or host.",
        show_default="board",
    ),
]
Calibration = Annotated[
    Path | None,
    Option(
        "--calibration",
        metavar="FILE",
        help="Hall sensor's table of --rig board, as identify hall writes it.",
        show_default=False,
    ),
]


def tell(controller: Control) -> None:
    """Say once, on the terminal, that a law of the user's runs interpreted."""
    from macromicro.control import settings

    if not settings.prepare(controller).compiles:
        words = "is plain Python: it runs interpreted, slower; `start` and `step` under @kernel"
        print(f"{controller.macro_law} {words} are compiled", file=sys.stderr)


class Group(TyperGroup):
    """Raises `InputError` for a command that is none of the group's."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command named `cmd_name`."""
        if cmd_name not in self.commands and not cmd_name.startswith("-"):
            names = ", ".join(self.commands)
            raise InputError(ctx.info_name or "command", printable(cmd_name), f"one of {names}")
        return super().get_command(ctx, cmd_name)


def whole(text: str | int) -> int:
    """Parser of an option; its message names the value, which typer's own does not."""
    try:
        return int(text)
    except ValueError:
        raise BadParameter(f"{text!r}; accepted: a whole number") from None
