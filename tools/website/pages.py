"""Pages of the documentation: which there are, their headings, links and order."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
INDEX = "docs/index.md"
# Pages beside docs/, and their names on the site.
BESIDE = {
    "README.md": "readme.md",
    "ARCHITECTURE.md": "architecture.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "deploy/README.md": "deploy.md",
}
_CODE = re.compile(r"^```.*?^```$|^(?:    [^\n]*\n)+", re.DOTALL | re.MULTILINE)
_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_HEADING = re.compile(r"^(#+) (.+)$", re.MULTILINE)


class Link(NamedTuple):
    """A link or picture of a page: what is shown, and where it leads."""

    text: str
    target: str
    picture: bool


class Section(NamedTuple):
    """A part of the navigation: its title and its pages, as paths from the repository's root."""

    title: str
    pages: tuple[str, ...]


def names() -> list[str]:
    """Every page, as a path from the repository's root."""
    found = sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md"))
    notebooks = sorted(p.relative_to(ROOT).as_posix() for p in ROOT.glob("notebooks/*.ipynb"))
    return [*BESIDE, *(name for name in found if ".template." not in name), *notebooks]


def prose(text: str) -> str:
    """A page without its blocks of code."""
    return _CODE.sub("", text)


def links(text: str) -> Iterator[Link]:
    """The links and pictures of a page, in order."""
    for found in _LINK.finditer(prose(text)):
        yield Link(found[2], found[3], found[1] == "!")


def linked(page: str, target: str) -> tuple[str, str]:
    """Where a link of `page` leads: a path from the root, and an anchor or ""."""
    path, _, anchor = target.partition("#")
    place = (ROOT / page).parent / path if path else ROOT / page
    return place.resolve().relative_to(ROOT).as_posix(), anchor


def anchors(text: str) -> set[str]:
    """The anchors of a page's headings, by the rule of Git hosts."""
    found: set[str] = set()
    for match in _HEADING.finditer(re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.M)):
        slug = re.sub(r"[^\w\- ]", "", match[2].lower()).replace(" ", "-")
        number = 1
        while slug in found:
            slug = f"{slug.removesuffix(f'-{number - 1}')}-{number}"
            number += 1
        found.add(slug)
    return found


def navigation() -> list[Section]:
    """The sections of the front page, and the pages that each links, not only a part of them."""
    text = (ROOT / INDEX).read_text(encoding="utf-8")
    sections = []
    for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        title, _, body = part.partition("\n")
        to = [link.target for link in links(body) if not re.search("://|#", link.target)]
        names = dict.fromkeys(linked(INDEX, target)[0] for target in to)
        here = [name for name in names if name.endswith((".md", ".ipynb"))]
        sections.append(Section(title.strip(), tuple(here)))
    return sections
