"""Titles and captions of figures as data: TOML files whose placeholders the figures fill."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Formatter
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.drawing.page import PageFigure

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class _Template(Formatter):
    """`str.format` that accepts no value without a placeholder."""

    def check_unused_args(
        self, used_args: set[int | str], args: Sequence[Any], kwargs: Mapping[str, Any]
    ) -> None:
        if unused := kwargs.keys() - used_args:
            raise KeyError(f"no placeholder for: {', '.join(sorted(unused))}")


def fill_words(template: str, /, **values: object) -> str:
    """A text with its values; KeyError for missing and for unused ones."""
    return _Template().format(template, **values)


class Caption(NamedTuple):
    title: str
    caption: str  # with placeholders
    claims: tuple[str, ...] = ()  # of the thesis, that the figure shows

    def page(self, name: str, figure: Figure, /, **values: object) -> PageFigure:
        """The figure for a page, in a file of a name."""
        return PageFigure(name, self.title, fill_words(self.caption, **values), figure)


def captions(path: Path) -> dict[str, Caption]:
    """All captions of a TOML file, by the names of its tables."""
    rows = tomllib.loads(path.read_text(encoding="utf-8"))
    return {
        name: Caption(row["title"], row["caption"], tuple(row.get("claims", ())))
        for name, row in rows.items()
    }
