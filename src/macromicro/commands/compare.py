"""``macromicro compare A B``: overlaid recordings and the differences of their moves."""

from __future__ import annotations

from pathlib import Path

from macromicro.commands.options import PNG
from macromicro.commands.signals import Signals

OUT = Path("results/compare")


def compare(
    recordings: list[Path] | None = None,
    out: Path | None = None,
    figures: str = PNG,
    as_json: bool = False,
    overwrite: bool = False,
) -> None:
    """Compare recordings in a figure and a table of differences."""
    from macromicro.drawing.files import formats
    from macromicro.report import comparison, terminal
    from macromicro.report.run import as_json as to_json
    from macromicro.runs import folder

    kinds = formats(figures)
    sides = comparison.load(recordings or [])
    names, out = comparison.FILES, folder.choose_folder(out, OUT, overwrite=overwrite)
    folder.check(out, comparison.BYTES, overwrite=overwrite, names=names)
    with Signals(), folder.locked(out, overwrite=overwrite, names=names):
        found = comparison.compare(sides)
        comparison.write(out, found, kinds)
    if as_json:
        print(to_json(comparison.content(found)), end="")
        return
    terminal.show_comparison(found)
    print(f"results: {out}")
