"""The folder of a comparison: compare.json, a zoomable page, a figure."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from macromicro import traces
from macromicro.drawing import files
from macromicro.report import zoomable
from macromicro.report.comparison import Comparison, content
from macromicro.report.run import as_json
from macromicro.runs import folder
from macromicro.schema.text import write_text

JSON = "compare.json"
OVERLAY = "overlay"
PAGE = f"{OVERLAY}.html"
BYTES = 20_000_000 + zoomable.BYTES
FILES = (JSON, PAGE, *files.names((OVERLAY,)))


def write(out: Path, found: Comparison, kinds: Sequence[str] = files.DEFAULT) -> None:
    """Write everything, all of it or nothing; an earlier comparison there is replaced.

    The figure shows the main columns, the page also all others that vary.
    """
    recordings = [side.recording for side in found.sides]
    labels = [side.name for side in found.sides]
    main = traces.chosen(recordings)
    rest = [name for name in found.columns if name not in main and _varies(found, name)]
    with folder.staged(out, remove=FILES) as place:
        write_text(place / JSON, as_json(content(found)))
        write_text(place / PAGE, zoomable.page(recordings, [*main, *rest], labels))
        if kinds:
            figure = traces.overlay(*recordings, columns=main, labels=labels)
            files.save(figure, place, OVERLAY, kinds)


def _varies(found: Comparison, name: str) -> bool:
    """Whether a column varies in one of the recordings, or differs between them."""
    values = [side.recording[name] for side in found.sides]
    return any(bool(np.any(each != values[0][0])) for each in values)
