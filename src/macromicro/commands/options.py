"""Options that several commands share: one wording and one meaning each."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from macromicro.commands.group import whole

PNG = "png"


def folder_option(default: object, what: str = "the results") -> Any:
    """The option ``--out`` of a command that writes a folder."""
    return Option("--out", help=f"Folder for {what}.", show_default=str(default))


Figures = Annotated[
    str,
    Option(
        "--figures",
        metavar="FORMATS",
        help="Formats of the figures: png, svg, pdf, several, such as svg,pdf, or none.",
    ),
]
Json = Annotated[bool, Option("--json", help="Print only the results, as JSON.")]
Fan = Annotated[bool, Option("--fan", help="Cool the actuator with a fan.")]
Workers = Annotated[
    int | None,
    Option(
        "--workers",
        parser=whole,
        metavar="N",
        help="Number of threads or processes.",
        show_default="one for each core",
    ),
]
Overwrite = Annotated[bool, Option("--overwrite", help="Replace earlier results.")]
Seed = Annotated[
    int, Option("--seed", parser=whole, metavar="N", help="Seed of noise, draws and searches.")
]
Config = Annotated[
    Path | None,
    Option(
        "--config",
        metavar="FILE",
        help="Settings file (.toml), which names the machine.",
        show_default="the two-stage machine with its defaults",
    ),
]
Rig = Annotated[
    str,
    Option(
        "--rig",
        metavar="NAME",
        help="twin (simulated), board (docs/board.md), MODULE:FACTORY of your own rig "
        "(docs/rigs.md), FILE.toml of a card (docs/rigs.md), or for run replay:FILE; for two axes "
        "one each, joined by +.",
    ),
]
Yes = Annotated[bool, Option("--yes", help="Move a rig without asking first.")]
Law = Annotated[
    str | None,
    Option(
        "--law",
        metavar="NAME",
        help="Control law, of the two-stage machine's stages both with a comma between; or "
        "MODULE:LAW of your own (docs/laws.md).",
        show_default="that of the settings",
    ),
]
Port = Annotated[
    str | None,
    Option(
        "--port",
        metavar="DEVICE",
        help="Serial port of --rig board (docs/board.md).",
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
