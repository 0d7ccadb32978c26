"""Sections of docs/validation/reliability.md, each between its marks, or of a file of its own."""

from __future__ import annotations

from pathlib import Path


def write(path: Path, name: str, text: str) -> None:
    """A section in place of the one before, or a new file."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    path.parent.mkdir(parents=True, exist_ok=True)
    old = path.read_text(encoding="utf-8") if path.exists() else ""
    before, found, rest = old.partition(begin)
    after = rest.partition(end)[2].removeprefix("\n") if found else ""
    path.write_text(f"{before}{begin}\n{text.rstrip()}\n{end}\n{after}", encoding="utf-8")
