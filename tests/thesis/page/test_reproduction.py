"""The page of a reproduction: every claim once, honest counts, no one's text run as HTML."""

from __future__ import annotations

import itertools
import re
from collections import Counter
from html.parser import HTMLParser
from typing import Any

import pytest

from macromicro.settings import Settings
from macromicro.thesis.claims import DIFFERS, NOT_MEASURED, REPRODUCED
from macromicro.thesis.errata import ERRATA, evidence
from macromicro.thesis.page import _counting, _placing
from macromicro.thesis.page.reproduction import About, page
from macromicro.thesis.reproduce import Result

WHEN = "2026-01-02 03:04:05+00:00"
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Parsed(HTMLParser):
    """Tags with attributes, the text, and the text inside each element that has an id."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[tuple[str, str | None]] = []
        self.inside: dict[str, str] = {}
        self.text = ""
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append((tag, dict(attrs).get("id")))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop()[0] == tag

    def handle_data(self, data: str) -> None:
        self.text += f"{data} "
        for _, name in self.open:
            if name:
                self.inside[name] = f"{self.inside.get(name, '')}{data} "

    def ids(self) -> list[str]:
        return [str(a["id"]) for _, a in self.tags if "id" in a]


def spaced(text: str) -> str:
    return " ".join(text.split())


@pytest.fixture(scope="module")
def html(reproduced: Any) -> str:
    return page(reproduced.results, reproduced.procedures, About(WHEN, 12.34, seed=7))


@pytest.fixture(scope="module")
def parsed(html: str) -> Parsed:
    return Parsed(html)


def test_is_well_formed_and_every_id_is_unique(parsed: Parsed) -> None:
    assert parsed.open == []
    assert [name for name, n in Counter(parsed.ids()).items() if n > 1] == []


def test_links_and_labels_lead_somewhere(parsed: Parsed) -> None:
    ids = set(parsed.ids())
    targets = [str(a["href"]) for tag, a in parsed.tags if tag == "a"]
    assert len(targets) > 50
    assert {t for t in targets if not t.startswith("#") or t[1:] not in ids} == set()
    labels = [str(a["aria-labelledby"]) for _, a in parsed.tags if "aria-labelledby" in a]
    assert set(labels) <= ids


def test_headings_are_in_order(parsed: Parsed) -> None:
    levels = [int(tag[1]) for tag, _ in parsed.tags if re.fullmatch("h[1-6]", tag)]
    assert levels[0] == 1 and levels.count(1) == 1
    assert all(b <= a + 1 for a, b in itertools.pairwise(levels))


def test_every_claim_stands_in_full_exactly_once(reproduced: Any, parsed: Parsed) -> None:
    claims = [c for r in reproduced.results for c in r.claims]
    places = [str(a["id"]) for tag, a in parsed.tags if tag == "article" and "claim" in class_of(a)]
    assert sorted(places) == sorted(c.id for c in claims)
    for claim in claims:
        found = spaced(parsed.inside[claim.id])
        parts = (claim.section, claim.claim, claim.verdict, claim.kind, claim.reason)
        for part in (*parts, claim.of, claim.basis, claim.rule):
            assert spaced(part) in found, claim.id
    assert "accepted 0.4627 to 0.4673 mm" in spaced(parsed.inside["D1"])


def class_of(attributes: dict[str, str | None]) -> list[str]:
    return str(attributes.get("class", "")).split()


def test_a_claim_stands_at_the_first_exhibit_that_shows_it(reproduced: Any) -> None:
    chapters = _placing.place(reproduced.results, reproduced.procedures, _placing.Anchors())
    parts = {p.result.name: p for chapter in chapters for p in chapter.parts}
    made = parts["made"]
    assert [c.claim.id for c in made.loose] == ["X1"]
    assert [[c.claim.id for c in p.cards] for p in made.panels] == [["X2"], [], []]
    assert [[c.claim.id for c in p.also] for p in made.panels] == [[], ["X2"], ["X2"]]
    assert [c.claim.id for c in parts["lost"].loose] == ["Y1", "Y2"]
    names = [p.anchor for p in made.panels]
    assert names == ["figure-4-3", "figure-4-3-2", "figure-4-19"]


def test_every_exhibit_is_there(reproduced: Any, parsed: Parsed) -> None:
    exhibits = [e for r in reproduced.results for e in r.exhibits]
    assert {e.kind for e in exhibits} == {"png", "svg", "table"}
    for exhibit in exhibits:
        assert f"{exhibit.label}: {exhibit.title}" in spaced(parsed.text)
        assert spaced(exhibit.caption) in spaced(parsed.text)
    images = [a for tag, a in parsed.tags if tag == "img"]
    assert len(images) == sum(e.kind == "png" for e in exhibits)
    for image in images:
        assert str(image["src"]).startswith("data:image/png;base64,")
        assert image["alt"] and image["loading"] == "eager"
        assert int(str(image["width"])) > 100 and int(str(image["height"])) > 100


def test_every_exhibit_is_listed_once_in_the_thesis_order(reproduced: Any, parsed: Parsed) -> None:
    chapters = _placing.place(reproduced.results, reproduced.procedures, _placing.Anchors())
    listed = _placing.index(chapters)
    places = [p.anchor for c in chapters for part in c.parts for p in part.panels]
    assert sorted(anchor for group in listed for _, anchor in group.exhibits) == sorted(places)
    headings = [group.heading for group in listed]
    assert [h.partition(":")[0] for h in headings] == [f"Chapter {n}" for n in "2346"]
    numbers = [[e.number for e, _ in group.exhibits] for group in listed]
    assert numbers[0] == ["Table 2.1"] and numbers[-1][0] == "Table 6.1"
    assert numbers[1] == sorted(numbers[1], key=lambda n: n.startswith("Table"))
    assert numbers[2] == ["4.3", "4.3", "4.19"]
    links = [str(a["href"])[1:] for tag, a in parsed.tags if tag == "a"]
    assert set(places) <= set(links)


def test_appendices_come_last_and_equations_after_tables() -> None:
    numbers = ["D.9", "(2.1)", "Table 2.1", "2.10 (stop)", "A.1", "10.1", "2.2", "odd"]
    found = sorted(numbers, key=_placing._order)
    assert found == ["2.2", "2.10 (stop)", "Table 2.1", "(2.1)", "10.1", "A.1", "D.9", "odd"]


def test_contents_name_the_sections_of_each_procedure(reproduced: Any, parsed: Parsed) -> None:
    contents = spaced(parsed.text).partition("Contents")[2].partition("All claims 9")[0]
    for p in reproduced.procedures:
        assert f"({', '.join(p.sections)})" in contents


def test_counts_are_those_of_the_claims(reproduced: Any, parsed: Parsed) -> None:
    claims = [c for r in reproduced.results for c in r.claims]
    whole = _counting.counts(claims)
    assert whole == _counting.Counts(
        sum(c.verdict == REPRODUCED for c in claims),
        sum(c.verdict == DIFFERS for c in claims),
        sum(c.verdict == NOT_MEASURED for c in claims),
    )
    assert whole.total == len(claims) and whole.not_measured >= 2
    shown = spaced(parsed.text)
    assert f"{whole.reproduced} reproduced" in shown
    assert f"{whole.total} claims in all" in shown


def test_kinds_add_up_and_a_failed_procedure_proves_no_kind(reproduced: Any) -> None:
    kinds = {kind: found for kind, _, found in _counting.by_kind(reproduced.results)}
    assert (
        sum(found.total for found in kinds.values())
        == _counting.counts([c for r in reproduced.results for c in r.claims]).total
    )
    assert kinds[_counting.FAILED] == _counting.Counts(0, 0, 2)
    assert kinds["calibrated"].reproduced >= 1


def test_a_selection_is_said_to_be_one(reproduced: Any, parsed: Parsed) -> None:
    assert "A selection" not in parsed.text
    few = page(reproduced.results[:1], reproduced.procedures, About(WHEN, 1.0))
    asked = sum(len(p.ids) for p in reproduced.procedures)
    count = len(reproduced.results[0].claims)
    assert f"A selection: {count} of the {asked} claims" in few


def test_hostile_text_is_only_text(html: str, parsed: Parsed) -> None:
    assert {"script", "b", "link", "iframe"} & {tag for tag, _ in parsed.tags} == set()
    assert parsed.text.count("<script>") >= 5
    assert not any(key.startswith("on") for _, a in parsed.tags for key in a)


def test_needs_no_network(html: str, parsed: Parsed) -> None:
    bare = re.sub(r"base64,[A-Za-z0-9+/=]+", "", html)
    bare = bare.replace('xmlns="http://www.w3.org/2000/svg"', "")
    assert "http:" not in bare and "https:" not in bare
    assert "@import" not in bare and not re.search(r"url\((?!#)", bare)
    sources = [str(a[k]) for _, a in parsed.tags for k in ("src", "srcset", "data") if k in a]
    assert all(s.startswith("data:image/png;base64,") for s in sources)


def test_a_failure_is_said_at_the_top_and_in_its_place(parsed: Parsed) -> None:
    text = spaced(parsed.text)
    assert text.count("ValueError: ") >= 4
    assert "This procedure failed:" in text and "Traceback" in text


def test_every_erratum_with_its_evidence(parsed: Parsed) -> None:
    assert len(ERRATA) >= 41
    articles = [a for tag, a in parsed.tags if tag == "article" and "erratum" in class_of(a)]
    assert len(articles) == len(ERRATA)
    text = spaced(parsed.text)
    for entry in ERRATA:
        assert f"erratum-{entry.number}" in parsed.ids()
        for part in (entry.place, entry.printed, entry.fault, entry.reading, *evidence(entry)):
            assert spaced(part) in text, entry.number


def test_says_when_and_with_what(parsed: Parsed) -> None:
    text = spaced(parsed.text)
    assert WHEN in text and "12.3 s" in text
    assert re.search(r"seed 7\b", text)
    assert "numpy" in text and "the defaults" in text


def test_says_other_settings_and_other_rigs() -> None:
    settings = Settings()
    laser = settings.sensors.laser._replace(noise=1e-6)
    changed = settings._replace(sensors=settings.sensors._replace(laser=laser))
    text = spaced(Parsed(page([], [], About(WHEN, 1.0, 0, changed))).text)
    assert "sensors.laser.noise" in text
    assert "1 um" in text
    rigged = spaced(Parsed(page([], [], About(WHEN, 1.0, rigs=("my board",)))).text)
    assert "my board" in rigged
    assert "calibrated parameters" not in rigged and "virtual benches" not in rigged


def test_a_result_of_an_unknown_procedure_has_a_place() -> None:
    text = Parsed(page([Result("mystery", [], [], 0.0)], [], About(WHEN, 1.0))).text
    assert "Other measurements" in text and "mystery" in text


def test_a_repeated_or_unfit_id_gets_one_of_its_own() -> None:
    anchors = _placing.Anchors()
    assert [anchors.take(x) for x in ("M1", "M1", 'a "b"', "§")] == ["M1", "M1-2", "a-b", "id"]
