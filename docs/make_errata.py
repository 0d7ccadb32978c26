"""Writes validation/errata.md, the thesis' misprints and contradictions, from the package's list.

python docs/make_errata.py
"""

from __future__ import annotations

from pathlib import Path

from macromicro.thesis.errata import ERRATA, Erratum

PAGE = Path(__file__).with_name("validation") / "errata.md"
HEAD = """\
# Misprints and contradictions of the thesis

Each row gives the place, the printed text, its fault and the reading used here. The page of
`macromicro reproduce` adds the evidence: words that contradict each other, and recomputed numbers.
`make docs` generates this page from `src/macromicro/thesis/errata.toml`.

| # | place | printed | fault | reading used here |
|---|---|---|---|---|
"""


def row(e: Erratum) -> str:
    """One erratum."""
    cells = (e.place, e.printed, e.fault, e.reading)
    return f"| {e.number} | " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |\n"


def page() -> str:
    """The whole page."""
    return HEAD + "".join(row(e) for e in ERRATA)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
