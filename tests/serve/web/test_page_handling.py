"""The page as people know such pages: read-out, unit, steps, points, clicks, files."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_parts import Page, saved

from macromicro.control.live import messages as m
from macromicro.schema.config import load_overrides
from macromicro.serve._instrument import Instrument
from macromicro.serve.settings import LiveSettings
from macromicro.serve.web._hub import Hub
from tests.browser import DESK
from tests.waiting import until


def classes(page: Page, selector: str) -> str:
    return str(page.find(selector).get_attribute("class"))


def off(page: Page, selector: str) -> bool:
    """Does a button look as if it made no sense?"""
    return page.find(selector).get_attribute("data-off") is not None


def choose(page: Page, selector: str, value: str) -> None:
    page.run(
        "const e = document.querySelector(arguments[0]); e.value = arguments[1];"
        "e.dispatchEvent(new Event('change', { bubbles: true }));",
        selector,
        value,
    )


@pytest.fixture
def in_mm(ready: Page) -> Iterator[Page]:
    yield ready
    choose(ready, "#unit", "mm")
    ready.run("localStorage.clear()")


def micro_step(page: Page) -> int:
    """A short move under way; its number."""
    choose(page, "#step", "0.0001")
    page.click("[data-stage=micro] .step-button[data-sign='1']")
    return page.begun()


@pytest.mark.slow
def test_the_span_is_shown_whenever_the_greeting_comes(page: Page) -> None:
    """The plots ask for their view before the server has said which spans there are."""
    page.show()
    page.run("sessionStorage.setItem('macromicro.span', '')")
    page.reload()
    until(lambda: page.run("return document.getElementById('span').value") == "10")
    choose(page, "#span", "60")
    page.reload()
    until(lambda: page.run("return document.getElementById('span').value") == "60")


def test_a_view_before_the_greeting_chooses_no_span(page: Page) -> None:
    page.show()
    page.run(
        "sessionStorage.clear(); document.getElementById('span').replaceChildren();"
        "document.getElementById('span').dispatchEvent(new Event('change'));"
    )
    assert page.run("return sessionStorage.getItem('macromicro.span')") is None


def test_stops_and_alarms_leave_the_plots_in_sight(page: Page) -> None:
    """With an alarm shown, two plots stand above the stops without scrolling."""
    page.station.emergency()
    page.show(DESK)
    until(lambda: page.text("#trust") != "")
    page.run("scrollTo(0, 0)")
    foot, plots = page.run(
        "return [document.querySelector('footer').getBoundingClientRect().top,"
        "[...document.querySelectorAll('.plot')].map(p => p.getBoundingClientRect().bottom)]"
    )
    height = page.run("return innerHeight")
    assert height - foot < 0.14 * height
    assert plots[1] <= foot


def test_a_position_that_is_not_known_looks_so(ready: Page) -> None:
    assert classes(ready, "#reading").split() == ["reading"]
    known = ready.find("#position").value_of_css_property("color")
    here = ready.station.snapshot().position_m
    ready.move(90.0 if here < 0.045 else 5.0)
    ready.moving()
    ready.click("#emergency")
    until(lambda: "untrusted" in classes(ready, "#reading"))
    assert ready.text("#uncertainty") == "not known: home first"
    assert ready.find("#position").value_of_css_property("color") != known


def test_a_page_that_hears_nothing_more_looks_old(
    ready: Page, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its connection stands, and no state comes: a frozen number must not look live."""
    with monkeypatch.context() as silent:
        silent.setattr(Hub, "look", lambda self, extra: None)
        until(lambda: "stale" in classes(ready, "#reading"))
        assert ready.text("#uncertainty").startswith("OLD")
        assert ready.text("#trust") == "position old"
    until(lambda: "stale" not in classes(ready, "#reading"))


def test_what_makes_no_sense_in_a_mode_looks_so(ready: Page) -> None:
    until(lambda: off(ready, "[data-do=enable]"))
    assert not off(ready, "#move") and not off(ready, "[data-do=home]")
    ready.click("[data-do=enable]")  # it can be pressed all the same, and says why not
    ready.says("the positioner is enabled")
    ready.click("[data-do=disable]")
    until(lambda: off(ready, "#move"))
    assert off(ready, "[data-do=home]") and not off(ready, "[data-do=enable]")
    assert off(ready, ".step-button") and off(ready, ".jog-button") and off(ready, "#run")


@pytest.mark.slow
def test_lengths_are_in_one_unit(in_mm: Page) -> None:
    page = in_mm
    motion = page.move(page.station.snapshot().position_m * 1e3 + 1.0)
    assert page.outcome(motion) == m.DONE
    choose(page, "#unit", "um")
    until(lambda: page.text("#position").endswith(" um"))
    shown = ["#position", "#target", "#to-go", "#macro", "#micro", "#limits", "#uncertainty"]
    for selector in shown:
        assert " mm" not in page.text(selector), (selector, page.text(selector))
        assert " um" in page.text(selector), (selector, page.text(selector))
    assert page.text("#move-unit") == "um"
    place = page.station.snapshot().position_m + 0.5e-3
    field = page.find("#move-value")
    field.clear()
    field.send_keys(f"{place * 1e6:.1f}")
    page.click("#move")
    motion = page.begun()
    assert page.outcome(motion) == m.DONE
    assert page.station.snapshot().position_m == pytest.approx(place, abs=20e-6)
    page.reload()  # the unit is kept
    until(lambda: page.text("#position").endswith(" um"))


def test_steps_move_by_their_length(ready: Page) -> None:
    before = ready.station.snapshot()
    choose(ready, "#step", "0.001")
    ready.click("[data-stage=macro] .step-button[data-sign='1']")
    motion = ready.begun()
    assert ready.outcome(motion) == m.DONE
    counts = ready.station.snapshot().macro_count - before.macro_count
    assert counts == pytest.approx(14.0, abs=1.0)  # 1 mm of 71.4 um a count
    motion = micro_step(ready)
    assert ready.outcome(motion) == m.DONE
    before = ready.station.snapshot()
    ready.click("[data-stage=whole] .step-button[data-sign='1']")
    motion = ready.begun()
    assert ready.outcome(motion) == m.DONE
    moved = ready.station.snapshot().position_m - before.position_m
    assert moved == pytest.approx(1e-4, abs=2e-5)


def test_a_step_below_a_count_is_refused_in_words(ready: Page) -> None:
    choose(ready, "#step", "0.00001")
    ready.click("[data-stage=macro] .step-button[data-sign='1']")
    ready.says("less than one count")
    assert ready.station.snapshot().motion == 0


@pytest.mark.slow
def test_points_are_taught_visited_and_saved(in_mm: Page, tmp_path: Path) -> None:
    page = in_mm
    motion = page.move(page.station.snapshot().position_m * 1e3 + 1.0)
    assert page.outcome(motion) == m.DONE
    page.says("arrived and settled")  # or it would say so over what is looked for below
    taught = page.station.snapshot().position_m
    page.click("#teach")
    page.says("Point saved")
    motion = page.move(taught * 1e3 + 0.8)
    assert page.outcome(motion) == m.DONE
    page.reload()  # points outlive the page
    until(lambda: page.find("#point-list button").is_enabled())
    page.click("#point-list button")
    motion = page.begun()
    assert page.outcome(motion) == m.DONE
    assert page.station.snapshot().position_m == pytest.approx(taught, abs=20e-6)
    file = tmp_path / "points.toml"
    file.write_text(saved(page, "#points-save"), encoding="utf-8")
    assert Instrument(page.station).programme(file).moves == 2
    page.click("#point-list button:last-of-type")
    until(lambda: page.text("#point-list") == "")


@pytest.mark.slow
def test_a_click_on_the_scales_proposes_and_moves_if_asked(ready: Page) -> None:
    ready.find("#move-value").clear()
    ready.click("#ruler")
    ready.says("filled in")
    proposed = float(ready.run("return document.getElementById('move-value').value"))
    here = ready.station.snapshot().position_m * 1e3  # the scales show it, the click was amidst
    assert abs(proposed - here) < 250.0
    assert ready.station.snapshot().motion == 0
    ready.click("#click-moves")
    ready.click("#ruler")
    motion = ready.begun()
    ready.click("#click-moves")
    assert ready.outcome(motion) == m.DONE


def test_a_programme_is_uploaded_and_run(ready: Page, tmp_path: Path) -> None:
    count = ready.station.snapshot().macro_count + 20
    file = tmp_path / "mine.toml"
    file.write_text(f'[[moves]]\nmacro = "{count:.0f} counts"\nhold = "0.2 s"\n')
    ready.find("#programme-file").send_keys(str(file))
    ready.says("mine.toml: 1 moves")
    ready.click("#run")
    motion = ready.begun()
    assert ready.outcome(motion) == m.DONE
    assert ready.station.snapshot().macro_count == pytest.approx(count, abs=1)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("far.toml", '[[moves]]\nmacro = "900 mm"\nhold = "1 s"\n', "far.toml"),
        ("slip.csv", "t_s,micro_mm\n0,0\n1,x\n", "slip.csv"),
        ("page.html", "<p>", "not a file name of a programme"),
    ],
)
def test_a_bad_programme_is_refused_with_its_place(
    ready: Page, tmp_path: Path, name: str, text: str, words: str
) -> None:
    file = tmp_path / name
    file.write_text(text)
    ready.find("#programme-file").send_keys(str(file))
    ready.says(words)
    assert str(tmp_path) not in ready.text("#status")
    assert "macromicro-" not in ready.text(
        "#status"
    )  # the server's own folder is nobody's business


def test_a_long_programme_comes_in_pieces(ready: Page, tmp_path: Path) -> None:
    rows = [f"{k / 100:.2f},{1.0 + 0.2 * (k % 5):.3f}" for k in range(3001)]
    rows.append("30.01,1.000")  # the last row only ends it
    file = tmp_path / "long.csv"
    file.write_text("t_s,micro_mm\n" + "\n".join(rows) + "\n")
    ready.find("#programme-file").send_keys(str(file))
    ready.says("long.csv: 3001 moves")


@pytest.mark.slow
def test_soft_limits_are_set_and_given_back(in_mm: Page) -> None:
    page = in_mm
    own = page.station.settings.live.limits
    page.run("document.getElementById('soft-limits').open = true")
    field = page.find("#limit-whole_high")
    assert float(field.get_attribute("value")) == pytest.approx(own.whole_high * 1e3)
    field.clear()
    field.send_keys("150")
    page.click("#limits-set")
    until(lambda: page.station.snapshot().limits.whole_high == pytest.approx(0.15))
    now = page.station.snapshot().limits
    assert now._replace(whole_high=own.whole_high) == own  # what was not touched is unchanged
    until(lambda: "to 150 mm" in page.text("#limits"))
    field.clear()
    field.send_keys("900")
    page.click("#limits-set")
    until(lambda: page.text("#limits-problem"))
    assert "Soft limits of" in page.text("#limits-problem")
    page.click("#limits-own")
    until(lambda: page.station.snapshot().limits == own)


def test_settings_in_force_are_saved(ready: Page, tmp_path: Path) -> None:
    station = ready.station
    holder = station.snapshot().holder
    own = station.settings.live.limits
    path, value = "sequence.wait", station.settings.controller.sequence.wait + 0.25
    try:
        assert isinstance(station.request(holder, m.SetGains(((path, value),))), m.Accepted)
        narrow = own._replace(whole_high=0.12)
        assert isinstance(station.request(holder, m.SetLimits(narrow)), m.Accepted)
        until(lambda: "to 120 mm" in ready.text("#limits"))
        text = saved(ready, "#save-settings")
        assert tomllib.loads(text)["live"]["limits"]
        file = tmp_path / "settings.toml"
        file.write_text(text, encoding="utf-8")
        loaded: Any = load_overrides(file, LiveSettings())
        assert loaded.controller.sequence.wait == pytest.approx(value)
        assert loaded.live.limits.whole_high == pytest.approx(0.12)
        assert loaded.serve == station.settings.serve
    finally:
        station.request(holder, m.SetGains(((path, value - 0.25),)))
        station.request(holder, m.SetLimits(None))
