"""``macromicro compare A B``: recordings on top of each other, and how their moves differ."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from macromicro.commands.group import PNG, Figures
from macromicro.commands.signals import Signals

OUT = Path("results/compare")


def compare(
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="A B ...",
            help="Recordings, folders of runs or measured data; all are compared with the first.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for figures and numbers.")] = OUT,
    figures: Figures = PNG,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the comparison as JSON, and nothing else.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace an earlier comparison.")
    ] = False,
) -> None:
    """Draw recordings on top of each other, and say how their columns and moves differ."""
    from macromicro.drawing.files import formats
    from macromicro.report import comparison, comparison_files, terminal
    from macromicro.report.summary import as_json as to_json
    from macromicro.runs import folder

    kinds = formats(figures)
    sides = comparison.load(recordings or [])
    names = comparison_files.FILES
    folder.check(out, comparison_files.BYTES, overwrite=overwrite, names=names)
    with Signals(), folder.held(out, overwrite=overwrite, names=names):
        found = comparison.compare(sides)
        comparison_files.write(out, found, kinds)
    if as_json:
        print(to_json(comparison.content(found)), end="")
        return
    terminal.show_comparison(found)
    print(f"results: {out}")
