"""The page of a machine of two axes: both places, a picture of the plane, moves to a point."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_parts import Page, opened
from selenium.webdriver.common.action_chains import ActionChains

from macromicro.control.live import messages as m
from tests.waiting import until

FILE = Path(__file__).parents[3] / "examples" / "machines" / "xy-plotter.toml"
SHOWN = (
    "return [...document.querySelectorAll(arguments[0])].filter(e => e.checkVisibility()).length"
)
INK = """
const c = document.querySelector('#plane-xy'), g = c.getContext('2d');
const data = g.getImageData(0, 0, c.width, c.height).data;
g.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--one').trim();
const [r, gr, b] = g.fillStyle.match(/\\w\\w/g).map(h => parseInt(h, 16));
let left = c.width, right = -1;
for (let k = 0; k < data.length; k += 4)
  if (data[k] === r && data[k + 1] === gr && data[k + 2] === b && data[k + 3] > 200) {
    const x = (k / 4) % c.width; left = Math.min(left, x); right = Math.max(right, x);
  }
return (right - left) / c.width;
"""


LINES = """
[x.switches]
limits = "both"
home = "cam"
"""
DRIVE = "[y.amplifier]\n", '[y.amplifier]\nenable = "line"\n'
LAMPS = "return [...document.querySelectorAll('#lines .badge')].map(e => e.textContent)"


@pytest.fixture
def plotter(driver: Any, tmp_path: Path) -> Iterator[Page]:
    with opened(driver, FILE, tmp_path) as page:
        yield page


@pytest.fixture
def equipped(driver: Any, tmp_path: Path) -> Iterator[Page]:
    file = tmp_path / FILE.name
    file.write_text(FILE.read_text(encoding="utf-8").replace(*DRIVE) + LINES, encoding="utf-8")
    with opened(driver, file, tmp_path) as page:
        yield page


def test_both_axes_are_homed_and_moved_to_a_point_from_the_page(plotter: Page) -> None:
    page, station = plotter, plotter.station
    assert page.text("#rig") == "xy xy-plotter (simulated)"
    assert page.run(SHOWN, "#ruler, #move-form, #points, #soft-limits, [data-of=macro]") == 0
    assert page.run(SHOWN, "#plane-xy, #point-form, .jog[data-stage=x], .jog[data-stage=y]") == 4
    words = r"Travel: x -?[\d.]+ to 20\d[\d.]* mm, y -?[\d.]+ to 7\d[\d.]* mm"
    until(lambda: re.fullmatch(words, page.text("#travels")) is not None)
    page.take()
    page.click("[data-do=enable]")
    until(lambda: station.snapshot().mode == "ready")
    page.click("[data-do=home]")
    until(lambda: station.snapshot().trusted and station.snapshot().motion == 0)
    for field, text in (("#point-x", "150"), ("#point-y", "500")):
        page.find(field).clear()
        page.find(field).send_keys(text)
    page.click("#move-point")
    assert page.text("#point-problem").startswith("y: 500 is outside ")
    page.find("#point-y").clear()
    page.find("#point-y").send_keys("60")
    page.click("#move-point")
    until(lambda: station.snapshot().motion == 0 and station.snapshot().axes[0].position_m > 0.149)

    def there() -> bool:
        x, y = (float(part.split()[1]) for part in page.text("#position").split(", "))
        return abs(x - 150.0) < 3e-3 and abs(y - 60.0) < 3e-3

    until(there)
    assert "Effort of xeffort" in page.text("#plots") and "CTRL" not in page.text("#plots")
    events = page.text("#events")
    assert "ready to moving:" in events and not re.search(r"\bmacro\b", events)
    until(lambda: page.run(INK) > 0.4)  # the way from home is drawn in the picture
    here = station.snapshot().axes[1].position_m
    page.click(".jog[data-stage=y] .step-button[data-sign='-1']")
    until(lambda: station.snapshot().axes[1].position_m < here - 0.9e-3)
    assert station.snapshot().axes[0].position_m == pytest.approx(0.150, abs=3e-6)
    assert station.request(station.snapshot().holder, m.Disable()) == m.Accepted()
    until(lambda: "disabled" in page.text("#mode"))
    assert page.problems() == []


@pytest.mark.slow
def test_both_axes_follow_a_drag_in_their_picture(plotter: Page) -> None:
    page, station = plotter, plotter.station
    page.take()
    client = station.snapshot().holder
    station.request(client, m.Enable())
    if not station.snapshot().trusted:
        reply = station.request(client, m.Home())
        assert isinstance(reply, m.Accepted) and page.outcome(reply.id) == m.DONE
    page.click("#drag-follows-xy")
    drag = ActionChains(page.driver).move_to_element(page.find("#plane-xy")).click_and_hold()
    drag.pause(1.5).move_by_offset(20, 5).pause(1.0).release().perform()
    page.click("#drag-follows-xy")
    until(lambda: "follow" in page.text("#events") and station.snapshot().motion == 0)
    assert page.text("#status").endswith("arrived and settled."), page.text("#events")
    assert min(axis.position_m for axis in station.snapshot().axes) > 0.02


@pytest.mark.slow
def test_switches_and_lines_of_both_axes_are_shown(equipped: Page) -> None:
    page = equipped
    until(lambda: page.run(LAMPS)[3:] == ["y drive off", "y enable line off"])
    first = page.run(LAMPS)
    assert first[:2] == ["x lower limit free", "x upper limit free"]
    assert first[2] in ("x home switch off", "x home switch on")
    page.take()
    page.click("[data-do=enable]")
    until(lambda: page.run(LAMPS)[-2:] == ["y drive on", "y enable line on"])


@pytest.fixture
def three(driver: Any, tmp_path: Path) -> Iterator[Page]:
    with opened(driver, FILE.with_name("xyz.toml"), tmp_path) as page:
        yield page


@pytest.mark.slow
def test_a_machine_of_three_stages_has_a_ruler_a_field_and_buttons_of_each(three: Page) -> None:
    page, station = three, three.station
    assert page.run(SHOWN, "#axis-rulers .ruler, #point-fields input, #axis-jogs .jog") == 9
    assert page.run(SHOWN, "#plane-xy, #ruler, #move-form") == 0
    until(lambda: "z 0 to 0.1" in page.text("#travels"))
    page.take()
    page.click("[data-do=enable]")
    until(lambda: station.snapshot().mode == "ready")
    page.click("[data-do=home]")
    until(lambda: station.snapshot().trusted and station.snapshot().motion == 0)
    for field, text in (("#point-x", "40"), ("#point-z", "500")):
        page.find(field).send_keys(text)
    page.click("#move-point")
    assert page.text("#point-problem").startswith("z: 500 is outside ")
    page.find("#point-z").clear()
    page.find("#point-z").send_keys("0.05")
    page.click("#move-point")
    until(lambda: station.snapshot().motion == 0 and station.snapshot().axes[2].position_m > 49e-6)
    x, y, z = (axis.position_m for axis in station.snapshot().axes)
    assert (x, y, z) == pytest.approx((0.04, 0.0, 50e-6), abs=3e-5)
    page.run("document.querySelector('#step').value = '0.000001'")
    page.click(".jog[data-stage=z] .step-button[data-sign='-1']")
    until(lambda: station.snapshot().axes[2].position_m < z - 0.9e-6)
    plots = page.text("#plots")
    assert all(f"Axis {n}" in plots and f"Effort of {n}" in plots for n in "xyz")
    assert page.problems() == []
