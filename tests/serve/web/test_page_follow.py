"""A set point dragged on the page: the stage follows the pointer, and rests where it is let go."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_parts import Page, opened
from selenium.webdriver.common.action_chains import ActionChains
from web_parts import until

from macromicro.control.live import messages as m

EXAMPLES = Path(__file__).parents[3] / "examples" / "machines"


@pytest.fixture(scope="module")
def screw(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with opened(driver, EXAMPLES / "screw.toml", tmp_path_factory.mktemp("screw")) as page:
        yield page


@pytest.fixture(scope="module")
def plotter(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with opened(driver, EXAMPLES / "xy-plotter.toml", tmp_path_factory.mktemp("plotter")) as page:
        yield page


def homed(page: Page) -> None:
    page.take()
    page.click("[data-do=enable]")
    until(lambda: page.station.snapshot().mode == "ready")
    page.click("[data-do=home]")
    until(lambda: page.station.snapshot().trusted and page.station.snapshot().motion == 0)


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
    motion = page.last + 2  # behind the homing
    end = page.ended(motion)
    assert end.outcome == m.DONE and end.evidence["set_points"] > 20
    limits = station.snapshot().limits
    low, high = limits.whole_low, limits.whole_high
    way = 5 * (width // 40) / (width - 64) * (high - low)
    assert end.position == pytest.approx(0.5 * (low + high) + way, abs=5e-3)
    assert page.find("#move-value").get_attribute("value") == ""  # no click was meant
    assert [entry["message"] for entry in page.driver.get_log("browser")] == []


@pytest.mark.slow
def test_both_axes_follow_a_drag_in_their_picture(plotter: Page) -> None:
    page, station = plotter, plotter.station
    homed(page)
    page.click("#drag-follows-xy")
    drag = ActionChains(page.driver).move_to_element(page.find("#plane-xy")).click_and_hold()
    drag.move_by_offset(20, 5).perform()
    motion = page.begun()
    until(lambda: min(axis.position_m for axis in station.snapshot().axes) > 0.02)
    ActionChains(page.driver).release().perform()
    assert page.outcome(motion) == m.DONE
