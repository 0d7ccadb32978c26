"""The place of each result on the page: chapters, procedures, exhibits, and claims once each."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from macromicro.drawing.exhibit import Exhibit
from macromicro.thesis.claims import Claim
from macromicro.thesis.contents import CHAPTERS
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Result

_NUMBER = re.compile(r"([A-Z]|\d+)\.(\d+)")


class Anchors:
    """Ids that are unique on the page and need no escaping in a link."""

    def __init__(self) -> None:
        self._taken: set[str] = set()

    def take(self, wanted: str) -> str:
        """`wanted` as a valid id, numbered if it is in use."""
        base = re.sub(r"[^A-Za-z0-9_.-]+", "-", wanted).strip("-") or "id"
        name, count = base, 1
        while name in self._taken:
            count += 1
            name = f"{base}-{count}"
        self._taken.add(name)
        return name


class Card(NamedTuple):
    claim: Claim
    anchor: str


class Panel(NamedTuple):
    """An exhibit with the claims printed beside it, and those printed elsewhere (`also`)."""

    exhibit: Exhibit
    anchor: str
    cards: list[Card]
    also: list[Card]


class Part(NamedTuple):
    result: Result
    title: str
    sections: tuple[str, ...]
    anchor: str
    loose: list[Card]
    panels: list[Panel]


class Chapter(NamedTuple):
    name: str
    title: str
    anchor: str
    parts: list[Part]


class Listed(NamedTuple):
    """The exhibits of a chapter in the thesis' order, each with the id of its place."""

    heading: str
    exhibits: list[tuple[Exhibit, str]]


def index(chapters: Sequence[Chapter]) -> list[Listed]:
    """All exhibits below the chapter that numbers them, wherever they stand."""
    panels = [panel for c in chapters for part in c.parts for panel in part.panels]
    groups: dict[str, list[tuple[Exhibit, str]]] = {}
    for panel in sorted(panels, key=lambda p: _order(p.exhibit.number)):
        name = _order(panel.exhibit.number)[1]
        heading = f"Chapter {name}" if name.isdigit() else f"Appendix {name}" if name else "Others"
        title = CHAPTERS.get(name if name.isdigit() else heading, "")
        groups.setdefault(f"{heading}: {title}" if title else heading, []).append(
            (panel.exhibit, panel.anchor)
        )
    return [Listed(heading, exhibits) for heading, exhibits in groups.items()]


def _order(number: str) -> tuple[int, str, int, int, str]:
    """Chapters before appendices; in each figures, tables, equations by their numbers."""
    found = _NUMBER.search(number)
    if found is None:
        return 1000, "", 0, 0, number
    rank = 1 if number.startswith("Table") else 2 if number.startswith("(") else 0
    chapter = int(found[1]) if found[1].isdigit() else 100 + ord(found[1])
    return chapter, found[1], rank, int(found[2]), number


def place(
    results: Sequence[Result], procedures: Sequence[Procedure], anchors: Anchors
) -> list[Chapter]:
    """`results` in their order, below the chapter of their procedure's first section."""
    known = {p.name: p for p in procedures}
    # Claims come first, so that their ids are their own.
    cards = [[Card(c, anchors.take(c.id)) for c in result.claims] for result in results]
    everywhere = {card.claim.id: card for each in cards for card in each}
    chapters: dict[str, Chapter] = {}
    for result, own in zip(results, cards, strict=True):
        procedure = known.get(result.name)
        sections = procedure.sections if procedure else ()
        name = _chapter(sections)
        if name not in chapters:
            heading = name if name.startswith("Appendix") else f"Chapter {name}"
            heading = heading if sections else "Other measurements"
            chapters[name] = Chapter(
                heading, CHAPTERS.get(name, ""), anchors.take(heading.lower()), []
            )
        panels = _panels(result.exhibits, own, everywhere, anchors)
        shown = {card.anchor for panel in panels for card in panel.cards}
        part = Part(
            result,
            procedure.title if procedure else result.name,
            sections,
            anchors.take(f"procedure-{result.name}"),
            [card for card in own if card.anchor not in shown],
            panels,
        )
        chapters[name].parts.append(part)
    return list(chapters.values())


def _chapter(sections: Sequence[str]) -> str:
    """ "4" of "4.2.1", "Appendix D" of "Appendix D.2"."""
    return sections[0].partition(".")[0] if sections else ""


def _panels(
    exhibits: Sequence[Exhibit], own: list[Card], everywhere: dict[str, Card], anchors: Anchors
) -> list[Panel]:
    """Each claim in full at the first exhibit of its procedure that shows it."""
    left = list(own)
    panels = []
    for exhibit in exhibits:
        cards = [card for card in left if card.claim.id in exhibit.claims]
        left = [card for card in left if card not in cards]
        here = {card.claim.id for card in cards}
        also = [
            everywhere[name]
            for name in dict.fromkeys(exhibit.claims)
            if name in everywhere and name not in here
        ]
        panels.append(Panel(exhibit, anchors.take(exhibit.name), cards, also))
    return panels
