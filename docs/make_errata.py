"""Writes validation/errata.md, the thesis' misprints and contradictions, from the package's list.

python docs/make_errata.py
"""

from __future__ import annotations

from pathlib import Path

from macromicro.thesis.errata import ERRATA, Erratum, evidence

PAGE = Path(__file__).with_name("validation") / "errata.md"
HEAD = """\
# Misprints and contradictions of the thesis

Each entry gives the place, the printed text, the fault, the reading used here, and the evidence:
words that contradict each other, and recomputed numbers. `macromicro reproduce` shows the same
list at the end of its page. `make docs` generates this page from
`src/macromicro/thesis/errata.toml`.

"""


def entry(e: Erratum) -> str:
    """One erratum."""
    lines = [
        f"## {e.number}. {e.place}",
        f"Printed: {e.printed}.",
        f"Fault: {e.fault}.",
        f"Reading: {e.reading}.",
        "\n".join(f"- {line}" for line in evidence(e)),
    ]
    return "\n\n".join(lines) + "\n"


def page() -> str:
    """The whole page."""
    return HEAD + "\n".join(entry(e) for e in ERRATA)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
