"""A set point dragged on the page: the stage follows the pointer, and rests where it is let go."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_parts import Page, opened, saved
from selenium.webdriver.common.action_chains import ActionChains

from macromicro.control.live import messages as m
from tests.browser import DESK, PHONE
from tests.waiting import until

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"


@pytest.fixture(scope="module")
def screw(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with opened(driver, EXAMPLES / "screw.toml", tmp_path_factory.mktemp("screw")) as page:
        yield page


def homed(page: Page) -> None:
    """Homed by the page, once."""
    if page.station.snapshot().trusted:
        return
    page.take()
    page.click("[data-do=enable]")
    until(lambda: page.station.snapshot().mode == "ready")
    page.click("[data-do=home]")
    until(lambda: page.station.snapshot().trusted and page.station.snapshot().motion == 0)


@pytest.mark.slow
def test_the_stage_follows_a_drag_on_the_scales_and_stays_there(screw: Page) -> None:
    page, station = screw, screw.station
    homed(page)
    page.click("#drag-follows")
    ruler = page.find("#ruler")
    width, height = ruler.size["width"], ruler.size["height"]
    page.run("arguments[0].scrollIntoView({block: 'center'})", ruler)
    drag = ActionChains(page.driver)
    drag.move_to_element_with_offset(ruler, 0, 8 - height // 2).click_and_hold().pause(1.5)
    for _ in range(5):
        drag.move_by_offset(width // 40, 0).pause(0.2)
    drag.pause(1.0).release().perform()  # a pointer that rests holds it
    end = page.ended(2)
    assert end.outcome == m.DONE and end.evidence["set_points"] > 20
    limits = station.snapshot().limits
    low, high = limits.whole_low, limits.whole_high
    way = 5 * (width // 40) / (width - 64) * (high - low)
    assert end.position == pytest.approx(0.5 * (low + high) + way, abs=5e-3)
    assert page.find("#move-value").get_attribute("value") == ""  # no click was meant
    assert page.problems() == []


def test_a_move_is_captured_and_its_curves_are_drawn_and_saved(screw: Page) -> None:
    page, station = screw, screw.station
    homed(page)
    page.unfold("#capture")
    for field, text in (("#capture-before", "0.05"), ("#capture-after", "x")):
        page.find(field).clear()
        page.find(field).send_keys(text)
    page.click("#capture-start")
    assert page.text("#capture-problem") == "After. Give a number."
    page.find("#capture-after").clear()
    page.find("#capture-after").send_keys("0,2")
    page.run("document.querySelector('#capture-signals [value=motor]').selected = true")
    page.click("#capture-start")
    until(lambda: page.text("#capture-state") == "Waiting for the trigger.")
    here = station.snapshot().position_m
    page.move(10.0 if here > 0.03 else 50.0)
    until(lambda: page.text("#capture-state") == "Complete.")
    captions = (
        "return [...document.querySelectorAll('#capture-plots figcaption')].map(e => e.textContent)"
    )
    assert page.run(captions) == ["motor [V]", "position [mm]"]
    widths = (
        "return [...document.querySelectorAll('#capture-plots figure')].map(e => "
        "e.clientWidth - e.querySelector('canvas').getBoundingClientRect().width)"
    )
    for size in (PHONE, DESK):  # they follow the screen although they are not drawn again
        page.shape(size)
        until(lambda: page.run(widths) == [0, 0])
    table = saved(page, "#capture-csv").splitlines()
    assert table[0] == "t [s],motor [V],position [mm]" and len(table) == 252
    assert float(table[51].split(",")[0]) == 0.0
    assert float(table[51].split(",")[2]) == pytest.approx(here * 1e3, abs=1e-2)
    assert float(table[251].split(",")[2]) != pytest.approx(here * 1e3, abs=0.1)
    page.find("#capture-after").clear()
    page.find("#capture-after").send_keys("900")
    page.click("#capture-start")
    until(lambda: "0 to 56 s" in page.text("#capture-problem"))
    page.run("document.querySelector('#capture-kind').value = 'edge'")
    page.run("document.querySelector('#capture-kind').dispatchEvent(new Event('change'))")
    assert page.find("#capture-threshold").is_displayed()
    page.click("#capture-stop")
    until(lambda: page.text("#capture-state") == "Stopped.")
    assert page.problems() == []
