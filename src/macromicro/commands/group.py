"""What the commands share: the group, whole-number options, the option --figures."""

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
        help=("Formats of the figures: png, svg, pdf, or several, such as svg,pdf."),
    ),
]
PNG = "png"
Law = Annotated[
    str | None,
    Option(
        "--law",
        metavar="NAME",
        help=(
            "Control law of the macro-stage, of the micro-stage, or both "
            "with a comma between; or MODULE:LAW of your own "
            "(docs/laws.md)."
        ),
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
        help="Where the loop of --rig board is closed: board or host.",
        show_default="board; host for a machine of one stage, whose law runs there",
    ),
]
Calibration = Annotated[
    Path | None,
    Option(
        "--calibration",
        metavar="FILE",
        help="Hall sensor's table for --rig board, written by identify hall.",
        show_default=False,
    ),
]


def tell(controller: Control) -> None:
    from macromicro.control import settings

    if not settings.prepare(controller).compiles:
        words = "is plain Python: it runs interpreted, slower; `start` and `step` under @kernel"
        print(f"{controller.macro_law} {words} are compiled", file=sys.stderr)


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
