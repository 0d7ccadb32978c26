"""The page of a machine of one stage: its name, travel and unit, nothing of a second stage."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_parts import Page, opened, saved

from macromicro.control.live import messages as m
from tests.waiting import until

FILE = Path(__file__).parents[3] / "examples" / "machines" / "piezo-100um.toml"


@pytest.fixture(scope="module")
def piezo(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with opened(driver, FILE, tmp_path_factory.mktemp("piezo")) as page:
        page.take()
        page.station.request(page.station.snapshot().holder, m.Enable())
        until(lambda: page.station.snapshot().mode == "ready")
        until(lambda: page.find("#move").is_enabled())
        yield page


def test_a_piezo_stage_is_moved_in_micrometres(piezo: Page) -> None:
    assert piezo.text("#rig") == "piezo piezo-100um (simulated)"
    assert "0 to 100 um" in piezo.text("#limits")
    shown = "return [...document.querySelectorAll('[data-of=micro]')].filter(e => !e.hidden).length"
    assert piezo.run(shown) == 0
    assert piezo.run("return document.getElementById('lines').hidden"), "it has no lines"
    assert piezo.outcome(piezo.move(42.5)) == "done"

    def there() -> bool:
        number, unit = piezo.text("#position").split()
        return unit == "um" and abs(float(number) - 42.5) < 0.02

    until(there)
    assert len(piezo.text("#position").split()[0].partition(".")[2]) == 3  # a count is 3.2 nm


@pytest.mark.slow
def test_points_become_a_programme_that_is_uploaded_and_run(piezo: Page, tmp_path: Path) -> None:
    station = piezo.station
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


def _all(page: Page, selector: str) -> list[str]:
    """Texts of what is seen."""
    script = "return [...document.querySelectorAll(arguments[0])].filter(e => e.checkVisibility())"
    found: list[str] = page.run(f"{script}.map(e => e.innerText.trim())", selector)
    return found


def test_the_page_of_a_piezo_names_it_and_reads_in_micrometres(piezo: Page) -> None:
    field = piezo.find("#move-value")
    assert piezo.outcome(piezo.move(25.0)) == "done"
    until(lambda: piezo.text("#target") == "25.000 um")
    settled = r"arrived and settled at 2[45]\.\d{3} um \(kind move to, [^)]* error -?[\d.e-]+ um\)"
    until(lambda: re.search(settled, piezo.text("#events")))
    assert "ready to moving: move (target 25 um)" in piezo.text("#events")
    plots = piezo.run(PLOTS)
    assert re.fullmatch(r"Piezoreference 25\.00 um.*position 2[45]\.\d\d um", plots[0]), plots
    assert re.fullmatch(r"Efforteffort -?\d+\.\d\d V", plots[1]) and len(plots) == 2
    offered = "return [...document.querySelectorAll('#move-kind option')].filter(e => !e.hidden)"
    assert piezo.run(f"{offered}.map(e => e.textContent)") == ["Position, to", "Position, by"]
    field.clear()
    field.send_keys("300")
    piezo.click("#move")
    assert piezo.text("#move-problem") == "300 is outside 0 to 100 um."
    piezo.run("document.querySelector('#soft-limits').open = true")
    assert _all(piezo, "#limits-fields label") == ["Lowest [um]", "Highest [um]"]
    labels = "return [...document.querySelectorAll('[data-stage=macro] [aria-label]')]"
    assert piezo.run(f"{labels}.map(e => e.ariaLabel)") == [
        "Step piezo down", "Jog piezo down", "Jog piezo up", "Step piezo up",
        "Speed of the piezo's jog",
    ]  # fmt: skip
    piezo.run("document.querySelectorAll('option[hidden]').forEach(e => e.remove())")
    whole = str(piezo.run("return document.body.innerText"))
    assert not re.search(r"macro-stage|micro-stage|moving-macro|CTRL|counts", whole, re.IGNORECASE)
    # What the server refuses in mm, the page says in the unit of the travel.
    script = "import('/names.js').then((it) => arguments[1](it.said(arguments[0])))"
    words = "position 0.3 mm of the macro-stage; give one from 0 to 0.1 mm"
    read = "position 300 um of the piezo; give one from 0 to 100 um"
    assert piezo.driver.execute_async_script(script, words) == read
    holder = piezo.station.snapshot().holder
    own = piezo.station.settings.live.limits
    piezo.station.request(holder, m.SetLimits(own._replace(whole_high=50e-6)))
    until(lambda: "(whole high 100 to 50 um)" in piezo.text("#events"))
    piezo.station.request(holder, m.SetLimits(None))


AXIS = """machine = "axis"
law = "tests.control.own_laws:limited"
[timing]
period = "2 ms"
[switches]
limits = "both"
home = "below"
[amplifier]
enable = "line"
fault = "line"
[homing]
on = "home"
[correction]
made = "2026-11-01"
cold = "19 degC"
hot = "21 degC"
"""


@pytest.fixture(scope="module")
def axis(driver: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    folder = tmp_path_factory.mktemp("axis")
    file = folder / "own.toml"
    file.write_text(AXIS, encoding="utf-8")
    with opened(driver, file, folder) as page:
        yield page


@pytest.mark.slow
def test_switches_and_lines_of_the_drive_are_shown(axis: Page) -> None:
    page = axis
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


@pytest.mark.slow
def test_a_column_of_a_law_is_plotted_with_its_words_and_unit(axis: Page) -> None:
    page = axis
    until(lambda: any(words.startswith("Law: ") for words in page.run(PLOTS)))
    assert page.run(PLOTS)[-1].startswith("Law: filtered speed")
    assert len([words for words in page.run(PLOTS) if words.startswith("Law: ")]) == 1
    page.take()
    page.station.request(page.station.snapshot().holder, m.Enable())
    until(lambda: page.station.snapshot().mode == "ready")
    # The law runs: it shows a number with its unit, and a line in its plot.
    until(lambda: "mm/s" in page.run(PLOTS)[-1] and page.run(PLOTS)[-1][-5] not in "-")
    until(lambda: page.run(DRAWN))


@pytest.mark.slow
def test_the_age_of_a_calibration_is_shown(axis: Page) -> None:
    told = axis.text("#calibrations")
    age = r"Calibrated on 2026-11-01, \d+ days ago, at 20\.0 \u00b0C \(19\.0 to 21\.0\)"
    assert re.fullmatch(age, told)


@pytest.mark.slow
def test_the_plots_go_by_the_loops_own_period(axis: Page) -> None:
    page = axis
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
