"""The thesis' claims beside the measurements: one self-contained HTML file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.drawing.exhibit import Exhibit
from macromicro.drawing.files import PNG, SVG
from macromicro.drawing.page import fill, uri
from macromicro.report.provenance import software
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.thesis.claims import DIFFERS, REPRODUCED
from macromicro.thesis.errata import ERRATA, Erratum, evidence
from macromicro.thesis.page import _counting, _free_parameters, claim_text
from macromicro.thesis.page._placing import Anchors, Card, index, place
from macromicro.thesis.procedure import Procedure
from macromicro.thesis.reproduce import Result, claims_of

if TYPE_CHECKING:
    from markupsafe import Markup

TEMPLATE = Path(__file__).with_name("reproduction.html.j2")
_OWN = ("main", "summary", "contents", "figures", "claims", "errata", "provenance", "kinds")  # ids
_FEW = 6  # numbers of a list that the overview shows
_TONES = {REPRODUCED: "good", DIFFERS: "bad"}
_PROLOG = re.compile(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<!--.*?-->", re.DOTALL)
_ID = re.compile(r"""(\bid=["']|url\(["']?#|href=["']#)([^"')]+)""")
_BOX = re.compile(r"""viewBox=["']\S+ \S+ ([0-9.]+) """)
_LEGIBLE = 736  # 46 rem: letters of 8 pt in a figure are still 9 pixels high
_LABEL = re.compile(r"""(\baria-(?:labelledby|describedby)=["'])([^"']+)""")


class About(NamedTuple):
    started: str  # date and time
    seconds: float
    seed: int = 0
    settings: Settings = Settings()
    rigs: tuple[str, ...] = ()  # real rigs only


class _Proof(NamedTuple):
    erratum: Erratum
    anchor: str
    lines: list[str]


def page(results: Sequence[Result], procedures: Sequence[Procedure], about: About) -> str:
    """The page as HTML. All text is escaped; our own diagrams are inserted."""
    anchors = Anchors()
    for own in _OWN:
        anchors.take(own)
    chapters = place(results, procedures, anchors)
    parts = [part for chapter in chapters for part in chapter.parts]
    cards = [
        c for p in parts for c in (*p.loose, *(card for panel in p.panels for card in panel.cards))
    ]
    order = {id(claim): k for k, claim in enumerate(claims_of(results))}
    claims = [c.claim for c in cards]
    parameters = _free_parameters.free_parameters(about.settings)
    return fill(
        TEMPLATE,
        about=about,
        chapters=chapters,
        figures=index(chapters),
        failures=[p for p in parts if p.result.failure],
        undrawn=[p for p in parts if p.result.notes],
        cards=sorted(cards, key=lambda card: order[id(card.claim)]),
        place=lambda name: _place(name, cards),
        counts=_counting.counts(claims),
        asked=sum(len(p.ids) for p in procedures),
        kinds=_counting.by_kind(results),
        parameters=_free_parameters.group(parameters),
        calibrated=_free_parameters.CALIBRATED,
        proofs=[_Proof(e, anchors.take(f"erratum-{e.number}"), evidence(e)) for e in ERRATA],
        provenance=_provenance(results, about),
        overrides=config.difference(about.settings, Settings()),
        few=_FEW,
        text=claim_text,
        tone=lambda claim: _TONES.get(claim.verdict, "open"),
        uri=uri,
        size=_size,
        inline=_inline,
        room=_room,
        PNG=PNG,
        SVG=SVG,
    )


def _place(name: str, cards: Sequence[Card]) -> str:
    """The place of a claim; "S5" is found as "S5a" if it was measured in parts."""
    same = (c.anchor for c in cards if re.fullmatch(f"{re.escape(name)}[a-z]?", c.claim.id))
    return next(same, "")


def _provenance(results: Sequence[Result], about: About) -> list[tuple[str, str]]:
    at_work = sum(r.seconds for r in results)
    return [
        *software(),
        ("rig", ", ".join(about.rigs) or "the virtual benches"),
        ("seed", str(about.seed)),
        ("started", about.started),
        ("took", f"{about.seconds:.1f} s; its procedures {at_work:.1f} s one after the other"),
    ]


def _size(exhibit: Exhibit) -> tuple[int, int]:
    """Width and height of a PNG picture [pixels], from its header."""
    data: Any = exhibit.data
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def _room(svg: str) -> int:
    """Smallest width of a diagram [pixels]: its own, at most 46 rem."""
    box = _BOX.search(svg)
    return min(_LEGIBLE, round(float(box[1]))) if box else _LEGIBLE


def _inline(svg: str, prefix: str) -> Markup:
    """A diagram for the page's body, its ids made unique by `prefix`."""
    from markupsafe import Markup

    text = _ID.sub(rf"\g<1>{prefix}-\g<2>", _PROLOG.sub("", svg))
    text = _LABEL.sub(lambda m: m[1] + " ".join(f"{prefix}-{name}" for name in m[2].split()), text)
    return Markup(text.strip())
