"""``macromicro plot FILE [COLUMNS]``: a recording as a page to zoom in, and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from macromicro.recording import Recording

OUT = Path("results/plot")
HTML = "html"


def plot(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="A recording, the folder of a run, or measured data (look FILE)."
        ),
    ],
    columns: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="COLUMNS",
            help="Names of columns; by default references, positions, laser and efforts.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="What is written: .html, .png, .svg or .pdf by its suffix; may be given again.",
            show_default="results/plot/<name>.html and .png",
        ),
    ] = None,
    start: Annotated[
        str | None, typer.Option("--from", metavar="TIME", help='Begin there, as "12.5 s".')
    ] = None,
    end: Annotated[str | None, typer.Option("--to", metavar="TIME", help="End there.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace existing files.")] = False,
) -> None:
    """Draw columns of a recording over time: a page to zoom in, and a picture (docs/recording.md).

    The page is one file that opens without a network. Columns of one unit share a panel.
    """
    from macromicro.errors import InputError
    from macromicro.files import recordings
    from macromicro.runs import folder
    from macromicro.units import quantity

    times = [
        None if text is None else quantity(text, "s", where)
        for text, where in ((start, "--from"), (end, "--to"))
    ]
    recording = recordings.recording(folder.recording(file), columns or [])
    if not len(recording):
        raise InputError(str(file), "no rows", "a recording with rows")
    name = file.stem if file.is_file() and file.stem != "recording" else recording.label
    places = out or [OUT / f"{name}.{kind}" for kind in (HTML, "png")]
    for place in places:
        _check(place, overwrite=overwrite)
    if times != [None, None]:
        recording = recording.part(*times)
    files = [(place, _written(recording, name, columns or [], place)) for place in places]
    for place, content in files:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
        print(f"results: {place}")


def _check(place: Path, *, overwrite: bool) -> None:
    """Refuse a file that cannot be written, before anything is drawn."""
    from macromicro.drawing.files import FORMATS
    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    where = f"--out {printable(place, 300)}"
    if place.suffix.lower()[1:] not in (HTML, *FORMATS):
        kinds = ", ".join(f".{kind}" for kind in (HTML, *FORMATS))
        raise InputError(where, place.suffix or "no suffix", f"one of {kinds}")
    if place.is_dir():
        raise InputError(where, "a folder", "a file")
    if place.exists() and not overwrite:
        raise InputError(where, "exists already", "a file that is not there yet, or --overwrite")


def _written(recording: Recording, name: str, columns: list[str], place: Path) -> bytes:
    from macromicro import traces
    from macromicro.drawing.files import encoded
    from macromicro.report import zoomable

    kind = place.suffix.lower()[1:]
    if kind == HTML:
        return zoomable.page([recording], columns, [name]).encode()
    return encoded(traces.overlay(recording, columns=columns, labels=[name]), kind)
