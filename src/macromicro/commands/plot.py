"""``macromicro plot FILE [COLUMNS]``: a recording as a zoomable page and as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from macromicro.commands.options import PNG

if TYPE_CHECKING:
    from macromicro.recording import Recording

OUT = Path("results/plot")
HTML = "html"


def plot(
    file: Path,
    columns: list[str] | None = None,
    out: list[Path] | None = None,
    start: str | None = None,
    end: str | None = None,
    overwrite: bool = False,
) -> None:
    """Plot a recording over time: a picture and a zoomable page.

    The page (docs/running.md) is one file that opens without a network. Columns of one unit share
    a panel.
    """
    from macromicro.drawing.files import formats
    from macromicro.errors import ProblemError
    from macromicro.files import recordings
    from macromicro.runs import folder
    from macromicro.units import quantity

    times = [
        None if text is None else quantity(text, "s", where)
        for text, where in ((start, "--from"), (end, "--to"))
    ]
    recording = recordings.recording(folder.recording(file), columns or [])
    if not len(recording):
        raise ProblemError(str(file), "the recording has no rows")
    name = file.stem if file.is_file() and file.stem != "recording" else recording.label
    places = out or [OUT / f"{name}.{kind}" for kind in (HTML, *formats(PNG))]
    for place in places:
        _check(place, overwrite=overwrite)
    if times != [None, None]:
        recording = recording.part(*times)
    files = [(place, _write(recording, name, columns or [], place)) for place in places]
    for place, content in files:
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(content)
        print(f"results: {place}")


def _check(place: Path, *, overwrite: bool) -> None:
    from macromicro.drawing.files import FORMATS
    from macromicro.errors import InputError, ProblemError
    from macromicro.schema.text import printable

    where = f"--out {printable(place, 300)}"
    if place.suffix.lower()[1:] not in (HTML, *FORMATS):
        kinds = ", ".join(f".{kind}" for kind in (HTML, *FORMATS))
        raise InputError(where, place.suffix or "no suffix", f"one of {kinds}")
    if place.is_dir():
        raise ProblemError(where, "this is a folder", "Name a file.")
    if place.exists() and not overwrite:
        raise ProblemError(
            where, "the file already exists", "Choose another one or add --overwrite."
        )


def _write(recording: Recording, name: str, columns: list[str], place: Path) -> bytes:
    from macromicro import traces
    from macromicro.drawing.files import encode
    from macromicro.report import zoomable

    kind = place.suffix.lower()[1:]
    if kind == HTML:
        return zoomable.page([recording], columns, [name]).encode(errors="backslashreplace")
    return encode(traces.overlay(recording, columns=columns, labels=[name]), kind)
