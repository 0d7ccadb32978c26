"""The page to zoom in, in a real browser: what a hand does to it and what it then shows.

Without a browser these tests are skipped, or fail where MACROMICRO_BROWSER is "required".
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from tests import browser
from tests.browser import DESK, LEAST_CONTRAST, PHONE, TEXTS, WIDER, Window, contrast
from tests.report.plotted import made

from macromicro.report import zoomable


class Page(Window):
    """The page, loaded anew with all rows shown."""

    def show(self, address: str, size: tuple[int, int] = DESK, scheme: str = "light") -> None:
        self.shape(size, scheme)
        self.driver.get_log("performance")
        self.driver.get_log("browser")
        self.driver.get(address)
        self.until("return document.body.dataset.ready === 'yes'")

    def until(self, script: str) -> None:
        from selenium.webdriver.support.ui import WebDriverWait

        WebDriverWait(self.driver, 20, 0.02).until(lambda _: self.run(script))

    def settled(self) -> None:
        """Past the next drawing."""
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(done))"
        )

    @property
    def span(self) -> list[float]:
        self.settled()
        values = "return ['from', 'to'].map(n => +document.getElementById(n).value)"
        return list(self.run(values))

    def at(self, kind: str, time: float, **more: Any) -> None:
        """The pointer at a time of the first plot, by the browser's own events."""
        box = self.run(
            "const b = document.querySelector('.u-over').getBoundingClientRect();"
            "return [b.left, b.top, b.width, b.height]"
        )
        low, high = self.span
        share = (time - low) / (high - low)
        place = {"x": box[0] + share * box[2], "y": box[1] + box[3] / 2}
        self.command("Input.dispatchMouseEvent", type=kind, **place, **more)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Page, str, str]]:
    """A page of one recording, and one of two."""
    browser.needed()
    place = tmp_path_factory.mktemp("zoomable")
    names = ["place", "stage_reference", "phase"]
    (place / "one.html").write_text(zoomable.page([made()], names, ["one"]))
    (place / "two.html").write_text(zoomable.page([made(), made(seed=8)], names, ["one", "two"]))
    driver = browser.driver(place / "profile", network=True)
    try:
        yield Page(driver), *((place / n).as_uri() for n in ("one.html", "two.html"))
    finally:
        driver.quit()


def inked(page: Page) -> list[int]:
    """Pixels of each plot that are not background."""
    return list(
        page.run(
            "return [...document.querySelectorAll('canvas')].map(c => { const d ="
            " c.getContext('2d').getImageData(0, 0, c.width, c.height).data; let n = 0;"
            " for (let k = 3; k < d.length; k += 4) n += d[k] > 128; return n; })"
        )
    )


def test_a_hand_zooms_and_comes_back(files: tuple[Page, str, str]) -> None:
    page, one, _ = files
    page.show(one)
    assert page.span == [0.0, pytest.approx(3.999)]
    assert len(inked(page)) == 2 and min(inked(page)) > 1000
    held: dict[str, Any] = {"button": "left", "buttons": 1, "clickCount": 1}
    page.at("mousePressed", 1.0, **held)
    page.at("mouseMoved", 1.5, **held)
    page.at("mouseReleased", 1.5, **held)
    width = 4.0 / (DESK[0] - 150)  # s a pixel, at most
    assert page.span == [pytest.approx(1.0, abs=width), pytest.approx(1.5, abs=width)]
    low, high = page.span
    page.at("mousePressed", 1.25, modifiers=8, **held)
    page.at("mouseMoved", 1.35, modifiers=8, **held)
    page.at("mouseReleased", 1.25, modifiers=8, **held)
    assert page.span[0] < low and page.span[1] - page.span[0] == pytest.approx(high - low, abs=1e-3)
    page.at("mouseWheel", 1.2, modifiers=2, deltaX=0, deltaY=-100)
    assert page.span[1] - page.span[0] < 0.7 * (high - low)
    for clicks in (1, 2):
        for kind in ("mousePressed", "mouseReleased"):
            page.at(kind, 1.2, button="left", clickCount=clicks)
    assert page.span == [0.0, pytest.approx(3.999)]


def test_one_row_s_peak_is_seen_and_read(files: tuple[Page, str, str]) -> None:
    """From 4000 rows to the one that leaves the ramp by 1 mm; the numbers are the recording's."""
    page, one, _ = files
    page.show(one)
    fill = "const [f, t] = arguments; document.getElementById('from').value = f;"
    fill += (
        "document.getElementById('to').value = t; document.querySelector('form').requestSubmit()"
    )
    page.run(fill, "1.230", "1.240")
    assert page.span == [pytest.approx(1.23), pytest.approx(1.24)]
    page.at("mouseMoved", 1.2342)
    page.settled()
    words = page.run(
        "return [...document.querySelectorAll('.legend button')].map(b => b.innerText)"
    )
    shown = float(words[0].removeprefix("place: ").removesuffix(" mm"))
    assert shown == pytest.approx(made()["place"][1234], abs=1e-6)
    assert words[1:] == ["stage_reference: 1.234 mm", "phase: 1"]
    page.run(fill, "1.24", "1.23")
    assert "two numbers in s" in page.run("return document.getElementById('fault').innerText")
    assert page.span == [1.24, 1.23]  # what was typed, for the person to mend


def test_a_name_hides_its_line(files: tuple[Page, str, str]) -> None:
    """Of two recordings each line has a name of its own."""
    page, _, two = files
    page.show(two)
    words = page.run(
        "return [...document.querySelectorAll('.legend button')].map(b => b.innerText)"
    )
    assert words[:4] == [f"{c}, {s}" for s in ("one", "two") for c in ("place", "stage_reference")]
    before = inked(page)[0]
    page.run(
        "for (const b of [...document.querySelectorAll('.legend button')].slice(0, 4)) b.click()"
    )
    assert inked(page)[0] < 0.7 * before
    pressed = "return document.querySelector('.legend button').getAttribute('aria-pressed')"
    assert page.run(pressed) == "false"


@pytest.mark.parametrize(("size", "scheme"), [(DESK, "light"), (PHONE, "dark")])
def test_it_is_legible_and_asks_no_network(
    files: tuple[Page, str, str], size: tuple[int, int], scheme: str
) -> None:
    page, _, two = files
    page.show(two, size, scheme)
    assert page.driver.get_log("browser") == []
    events = [json.loads(e["message"])["message"] for e in page.driver.get_log("performance")]
    asked = [e["params"]["request"]["url"] for e in events
             if e["method"] == "Network.requestWillBeSent"]  # fmt: skip
    assert asked and all(url.startswith(("file:", "data:")) for url in asked)
    for ink, paper, what in page.run(TEXTS):
        assert contrast(ink, paper) >= LEAST_CONTRAST, what
    excess, wider = page.run(WIDER)
    assert excess <= 0 and wider == []
