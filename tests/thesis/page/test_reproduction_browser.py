"""The page of a reproduction in a real browser, on a desk and on a phone, light and dark.

Without a browser these tests are skipped, or fail where MACROMICRO_BROWSER is "required".
"""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests import browser
from tests.browser import DESK, LEAST_CONTRAST, PHONE, TEXTS, WIDER, Window, contrast, luminance

from macromicro.thesis import all_procedures, reproduce
from macromicro.thesis.errata import ERRATA
from macromicro.thesis.page import files
from macromicro.thesis.page.reproduction import About
from macromicro.thesis.procedure import Lab
from macromicro.thesis.reproduce import Chosen, Result


class Opened(Window):
    """The page in a browser. Every load begins with an empty log."""

    def __init__(self, driver: Any, file: Path, results: list[Result]) -> None:
        super().__init__(driver)
        self.file, self.results = file, results
        self.log: list[dict[str, Any]] = []

    def show(self, size: tuple[int, int] = DESK, scheme: str = "light") -> None:
        """Load the page anew in a window of this size and colour scheme."""
        self.shape(size, scheme)
        self.driver.get_log("performance")
        self.driver.get_log("browser")
        self.driver.get(self.file.as_uri())
        events = self.driver.get_log("performance")
        self.log = [json.loads(event["message"])["message"] for event in events]


@pytest.fixture(
    scope="module",
    params=["some", pytest.param("all", marks=pytest.mark.slow)],
)
def opened(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Opened]:
    """Some procedures and a failed one; slow: all procedures of the thesis."""
    browser.needed()
    place = tmp_path_factory.mktemp("browser")
    if request.param == "all":
        procedures = all_procedures()
        results = reproduce.run([Chosen(p) for p in procedures], Lab(), 2)
    else:
        results, procedures = request.getfixturevalue("reproduced")
    about = About("2026-01-02 03:04:05+00:00", 1.0)
    file = files.write(place / "out", results, procedures, about)
    driver = browser.driver(place / "profile", network=True)
    try:
        yield Opened(driver, file, results)
    finally:
        driver.quit()


def test_every_picture_loads(opened: Opened) -> None:
    opened.show()
    images = opened.run(
        "return [...document.images].map(i => [i.alt, i.complete, i.naturalWidth, i.offsetWidth])"
    )
    exhibits = [e for r in opened.results for e in r.exhibits]
    assert len(images) == sum(e.kind == "png" for e in exhibits) > 0
    for alt, complete, natural, shown in images:
        assert alt and complete and natural > 100 and shown > 100, alt
    diagrams = opened.run(
        "return [...document.querySelectorAll('svg')].map(s => s.getBoundingClientRect().width)"
    )
    assert len(diagrams) == sum(e.kind == "svg" for e in exhibits) > 0
    assert min(diagrams) > 100


def test_every_claim_and_erratum_has_its_place(opened: Opened) -> None:
    opened.show()
    ids = opened.run("return [...document.querySelectorAll('[id]')].map(e => e.id)")
    for claim in (c for r in opened.results for c in r.claims):
        assert ids.count(claim.id) == 1, claim.id
    for entry in ERRATA:
        assert ids.count(f"erratum-{entry.number}") == 1
    assert len(set(ids)) == len(ids)


def test_links_lead_to_what_can_be_seen(opened: Opened) -> None:
    opened.show()
    dead = opened.run(
        "return [...document.querySelectorAll('a')].filter(a => "
        "!document.getElementById(decodeURIComponent(a.hash.slice(1)))"
        "?.checkVisibility()).map(a => a.href)"
    )
    assert dead == []
    place = "procedure-" + opened.results[-1].name
    opened.run(f"document.querySelector('nav a[href=\"#{place}\"]').click()")
    top = opened.run(f"return document.getElementById('{place}').getBoundingClientRect().top")
    assert opened.run("return scrollY") > 0 and 0 <= top < DESK[1]


@pytest.mark.parametrize("size", [PHONE, DESK])
def test_nothing_is_wider_than_the_screen(opened: Opened, size: tuple[int, int]) -> None:
    opened.show(size)
    assert opened.run("return innerWidth") == size[0]
    for closed in (True, False):
        if not closed:
            opened.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        excess, wider = opened.run(WIDER)
        assert excess <= 0 and wider == []


def test_figures_stay_legible_on_a_phone(opened: Opened) -> None:
    opened.show(PHONE)
    widths = opened.run("return [...document.images].map(i => i.getBoundingClientRect().width)")
    assert min(widths) >= 46 * 16
    hints = opened.run(
        "return [...document.querySelectorAll('.hint')].map(e => e.checkVisibility())"
    )
    assert len(hints) == len(widths) and all(hints)
    opened.show(DESK)
    assert not opened.run("return document.querySelector('.hint').checkVisibility()")


def test_a_phone_shows_the_verdicts_without_scrolling(opened: Opened) -> None:
    verdicts = (
        "return [...document.querySelectorAll('.overview .verdict')]"
        ".filter(e => e.checkVisibility()).map(e => e.getBoundingClientRect().right)"
    )
    claims = sum(len(r.claims) for r in opened.results)
    for size in (PHONE, DESK):
        opened.show(size)
        rights = opened.run(verdicts)
        assert len(rights) == claims and max(rights) <= size[0]


@pytest.mark.parametrize(("scheme", "dark"), [("light", False), ("dark", True)])
def test_text_stands_out(opened: Opened, scheme: str, dark: bool) -> None:
    opened.show(scheme=scheme)
    opened.run("document.querySelectorAll('details').forEach(d => d.open = true)")
    texts = opened.run(TEXTS)
    kinds = " ".join(name for _, _, name in texts)
    assert "verdict good" in kinds and "verdict bad" in kinds and "faint" in kinds
    faint = [(name, contrast(c, b)) for c, b, name in texts if contrast(c, b) < LEAST_CONTRAST]
    assert faint == []
    paper = opened.run("return getComputedStyle(document.body).backgroundColor")
    colour = [float(v) for v in paper.strip("rgb()").split(",")]
    assert (luminance(colour) < 0.05) == dark


def test_diagrams_follow_the_colour_scheme(opened: Opened) -> None:
    """They are drawn in the page's ink, so boxes must not be filled with it."""
    for scheme in ("light", "dark"):
        opened.show(scheme=scheme)
        ink, boxes = opened.run(
            "const ink = getComputedStyle(document.body).color;"
            "return [ink, [...document.querySelectorAll('svg rect')]"
            ".map(r => getComputedStyle(r).fill)]"
        )
        assert len(boxes) > 3 and ink not in boxes


def test_it_can_be_walked_by_keyboard(opened: Opened) -> None:
    from selenium.webdriver.common.keys import Keys

    opened.show()
    opened.driver.switch_to.active_element.send_keys(Keys.TAB)
    assert opened.run("return document.activeElement.hash") == "#main"
    assert opened.run("return document.activeElement.getBoundingClientRect().left") >= 0
    stuck = opened.run(
        "return [...document.querySelectorAll('*')].filter(e => "
        "['auto', 'scroll'].includes(getComputedStyle(e).overflowX) && e.tabIndex < 0)"
        ".map(e => e.outerHTML.slice(0, 80))"
    )
    assert stuck == []


def test_it_asks_no_network_and_has_no_errors(opened: Opened) -> None:
    opened.show()
    page = opened.file.as_uri()
    sent = [e["params"] for e in opened.log if e["method"] == "Network.requestWillBeSent"]
    # A browser that has just begun still loads its own first tab.
    asked = {event["request"]["url"] for event in sent if event["documentURL"] == page}
    assert page in asked  # else the log would be blind
    assert {url for url in asked if not url.startswith("data:image/png;base64,")} == {page}
    entries = opened.run("return performance.getEntriesByType('resource').map(e => e.name)")
    assert [name for name in entries if not name.startswith("data:")] == []
    said = [entry["message"] for entry in opened.driver.get_log("browser")]
    assert [text for text in said if not text.startswith("chrome://")] == []
    assert opened.driver.title == "The thesis reproduced: macromicro"


def test_it_prints(opened: Opened) -> None:
    opened.show()
    printed = base64.b64decode(opened.command("Page.printToPDF", printBackground=False)["data"])
    assert printed.startswith(b"%PDF") and len(printed) > 50_000


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [PHONE, DESK])
def test_a_picture_of_it_is_kept(
    opened: Opened, size: tuple[int, int], scheme: str, tmp_path: Path
) -> None:
    opened.show(size, scheme)
    place = tmp_path / f"page-{size[0]}-{scheme}.png"
    opened.picture(place)
    header = place.read_bytes()[:24]
    assert header.startswith(b"\x89PNG")
    assert int.from_bytes(header[16:20], "big") == size[0]
