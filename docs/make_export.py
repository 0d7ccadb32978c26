"""Writes the tables of docs/export.md: which kernels are exported, which not and why.

python docs/make_export.py
"""

from __future__ import annotations

from pathlib import Path

from macromicro.export.coverage import table

PAGE = Path(__file__).with_name("export.md")
MARK = "## Which kernels\n\n"


def main() -> None:
    """Replace what stands behind the mark, which is the page's end."""
    text = PAGE.read_text(encoding="utf-8")
    head, _, _ = text.partition(MARK)
    PAGE.write_text(f"{head}{MARK}{table()}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
