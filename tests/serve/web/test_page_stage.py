"""The page of a machine of one stage: its name, travel and unit, nothing of a second stage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from page_parts import Page, saved
from web_parts import until

from macromicro.control.live import messages as m
from macromicro.serve.stage import settings as stage
from macromicro.serve.station import Station
from macromicro.serve.web import WebServer
from tests import browser

FILE = Path(__file__).parents[3] / "examples" / "machines" / "piezo-100um.toml"


@pytest.fixture
def piezo(chromium: None, tmp_path: Path) -> Iterator[Page]:
    with opened(FILE, tmp_path) as page:
        yield page


@contextmanager
def opened(file: Path, tmp_path: Path) -> Iterator[Page]:
    """The page of the machine in a file."""
    settings = stage.load(file)
    assert settings is not None
    patient = settings.serve._replace(miss_share=1.0, loop_timeout=5.0, parent_timeout=5.0)
    station = Station(settings=settings._replace(serve=patient), state=tmp_path / "p.json")
    with station, WebServer(station, port=0, folder=tmp_path) as server:
        driver = browser.driver(tmp_path / "browser", "127.0.0.1")
        try:
            page = Page(driver, server, station)
            page.show()
            yield page
        finally:
            driver.quit()


def test_a_piezo_stage_is_moved_in_micrometres(piezo: Page) -> None:
    assert piezo.text("#rig") == "piezo piezo-100um (simulated)"
    assert "0 to 100 um" in piezo.text("#limits")
    shown = "return [...document.querySelectorAll('[data-of=micro]')].filter(e => !e.hidden).length"
    assert piezo.run(shown) == 0
    piezo.take()
    piezo.station.request(piezo.station.snapshot().holder, m.Enable())
    until(lambda: piezo.station.snapshot().mode == "ready")
    until(lambda: piezo.find("#move").is_enabled())
    assert piezo.outcome(piezo.move(42.5)) == "done"

    def there() -> bool:
        number, unit = piezo.text("#position").split()
        return unit == "um" and abs(float(number) - 42.5) < 0.02

    until(there)
    assert len(piezo.text("#position").split()[0].partition(".")[2]) == 3  # a count is 3.2 nm


def test_points_become_a_programme_that_is_uploaded_and_run(piezo: Page, tmp_path: Path) -> None:
    piezo.take()
    station = piezo.station
    station.request(station.snapshot().holder, m.Enable())
    until(lambda: station.snapshot().mode == "ready")
    until(lambda: piezo.find("#move").is_enabled())
    kept = "return document.querySelectorAll('#point-list li').length"
    kept_place = "const now = window.macromicro.state(); return now.target_m ?? now.position_m"
    for number, place in enumerate((20.0, 30.0), 1):
        assert piezo.outcome(piezo.move(place)) == "done"
        # The page hears of it later than the station, and keeps what it shows.
        until(lambda place=place: abs(piezo.run(kept_place) * 1e6 - place) < 0.02)
        piezo.click("#teach")
        until(lambda number=number: piezo.run(kept) == number)
    file = tmp_path / "points.toml"
    file.write_text(saved(piezo, "#points-save"), encoding="utf-8")
    piezo.find("#programme-file").send_keys(str(file))
    until(lambda: "points.toml" in piezo.text("#programme"))
    assert piezo.outcome(piezo.move(60.0)) == "done"
    piezo.click("#run")
    assert piezo.outcome(piezo.begun()) == "done"
    assert station.snapshot().position_m == pytest.approx(30e-6, abs=20e-9)


def test_the_gains_of_its_law_are_shown(piezo: Page) -> None:
    assert piezo.run("return document.querySelectorAll('#gains-rows tr').length") > 3
    shown = "return document.getElementById('programme').options[0].value"
    assert piezo.run(shown) == "usual"


SWITCHES = """machine = "axis"
[switches]
limits = "both"
home = "below"
[amplifier]
enable = "line"
fault = "line"
[homing]
on = "home"
"""


def test_switches_and_lines_of_the_drive_are_shown(chromium: None, tmp_path: Path) -> None:
    file = tmp_path / "switches.toml"
    file.write_text(SWITCHES, encoding="utf-8")
    with opened(file, tmp_path) as page:
        lamps = "return [...document.querySelectorAll('#lines .badge')].map(e => e.textContent)"
        until(lambda: page.run(lamps))
        assert not page.run("return document.getElementById('lines').hidden")
        before = page.run(lamps)
        # At 0 mm it stands below the upper edge of the home switch, and in no limit switch.
        assert before == [
            "lower limit free", "upper limit free", "home switch on", "drive well", "drive off",
            "enable line off",
        ]  # fmt: skip
        page.take()
        page.station.request(page.station.snapshot().holder, m.Enable())
        until(lambda: page.run(lamps)[-2:] == ["drive on", "enable line on"])
        assert page.run(lamps)[:4] == before[:4]


LAW = """machine = "axis"
law = "tests.control.own_laws:limited"
"""
PLOTS = """
return [...document.querySelectorAll('#plots figure.plot')].filter(e => e.checkVisibility())
  .map(e => e.querySelector('figcaption').textContent);
"""
DRAWN = """
const plot = [...document.querySelectorAll('#plots figure.plot')].at(-1);
const c = plot.querySelector('canvas'), data = c.getContext('2d')
  .getImageData(0, 0, c.width, c.height).data;
const g = document.createElement('canvas').getContext('2d');
g.fillStyle = getComputedStyle(document.documentElement).getPropertyValue('--one').trim();
const line = g.fillStyle.match(/\\w\\w/g).map(h => parseInt(h, 16));
let ink = 0;
for (let k = 0; k < data.length; k += 4)
  if (data[k + 3] > 100 && line.every((v, i) => Math.abs(v - data[k + i]) < 40)) ink += 1;
return ink > 20;
"""


def test_a_column_of_a_law_is_plotted_with_its_words_and_unit(
    chromium: None, tmp_path: Path
) -> None:
    file = tmp_path / "own.toml"
    file.write_text(LAW, encoding="utf-8")
    with opened(file, tmp_path) as page:
        until(lambda: any(words.startswith("Law: ") for words in page.run(PLOTS)))
        assert page.run(PLOTS)[-1].startswith("Law: filtered speed")
        assert len([words for words in page.run(PLOTS) if words.startswith("Law: ")]) == 1
        page.take()
        page.station.request(page.station.snapshot().holder, m.Enable())
        until(lambda: page.station.snapshot().mode == "ready")
        # The law runs: it shows a number with its unit, and a line in its plot.
        until(lambda: "mm/s" in page.run(PLOTS)[-1] and page.run(PLOTS)[-1][-5] not in "-")
        until(lambda: page.run(DRAWN))


def test_the_plots_go_by_the_loops_own_period(chromium: None, tmp_path: Path) -> None:
    file = tmp_path / "slow.toml"
    file.write_text('machine = "axis"\n[timing]\nperiod = "2 ms"\n', encoding="utf-8")
    with opened(file, tmp_path) as page:
        # One look: the page begins another ring whenever its width or what is plotted changes.
        ring = "const r = window.macromicro.ring(); return r && r.newest > 0 && [r.period, "
        ring += "r.width * r.columns, r.end(r.newest) - r.time, r.width]"

        def drawn() -> list[float] | None:
            found: list[float] | None = page.run(ring)
            return found if found and found[0] == 2e-3 else None

        period, span, off, width = until(drawn)
        assert span == pytest.approx(10.0, rel=0.05)
        # The newest row is in the newest column: its right end is no more than that away.
        assert -period <= off <= width
