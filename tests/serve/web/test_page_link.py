"""The page without its connection: what it says, and how it stops the machine all the same."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from page_parts import Page

from macromicro.control.live import messages as m
from macromicro.serve.web import WebServer
from tests.browser import DESK, PHONE
from tests.waiting import until


@pytest.fixture
def tabs(ready: Page) -> Iterator[tuple[str, str]]:
    """The page, in control, and its duplicate, which has its session and comes to the front."""
    driver = ready.driver
    first = driver.current_window_handle
    ready.run("window.open(location.href, '_blank')")
    second = until(lambda: [h for h in driver.window_handles if h != first])[0]
    driver.switch_to.window(second)
    ready.shown()
    until(lambda: "This page holds control" in ready.text("#holder"))
    driver.switch_to.window(first)
    until(lambda: "another tab" in ready.text("#alarm-list"))
    yield first, second
    driver.switch_to.window(second)
    driver.close()
    driver.switch_to.window(first)


def test_a_page_that_is_open_elsewhere_says_so(ready: Page, tabs: tuple[str, str]) -> None:
    alarm = ready.text("#alarm-list")
    assert "active in another tab" in alarm and "by itself" not in alarm
    assert ready.text("#holder") == "" and ready.text("#trust") == ""
    assert ready.find("#here").is_displayed() and not ready.find("#move").is_enabled()
    ready.click("#here")
    until(lambda: "This page holds control" in ready.text("#holder"))
    assert "another tab" not in ready.text("#alarm-list")
    assert not ready.find("#here").is_displayed()
    ready.driver.switch_to.window(tabs[1])
    until(lambda: "another tab" in ready.text("#alarm-list"))


@pytest.mark.parametrize("how", [pytest.param("#stop", marks=pytest.mark.slow), "#emergency"])
def test_a_page_that_is_open_elsewhere_stops_the_machine(
    ready: Page, tabs: tuple[str, str], how: str
) -> None:
    first, second = tabs
    ready.driver.switch_to.window(second)
    here = ready.station.snapshot().position_m
    motion = ready.move(90.0 if here < 0.045 else 5.0)
    ready.moving()
    ready.driver.switch_to.window(first)
    assert ready.text("#link") == "open in another tab"
    ready.find(how).click()
    wanted = m.EMERGENCY if how == "#emergency" else m.STOPPED_BY_REQUEST
    assert ready.outcome(motion) == wanted
    if how == "#emergency":
        ready.says("Emergency stop: outputs off")
    else:  # its answer, or already how the motion ended
        until(lambda: any(w in ready.text("#status") for w in ("Stop: done", " stopped.")))
    until(lambda: ready.text("#link") == "connected")
    # The other tab goes on, with its control: this one is a new viewer.
    ready.driver.switch_to.window(second)
    assert "This page holds control" in ready.text("#holder")
    assert ready.text("#link") == "connected"


@pytest.mark.parametrize("size", [pytest.param(DESK, marks=pytest.mark.slow), PHONE])
def test_stops_without_a_server_name_the_machines_own_switch(
    page: Page, profile: Path, size: tuple[int, int]
) -> None:
    page.free()
    page.station.emergency()
    server = WebServer(page.station, port=0, folder=profile)
    server.start()
    port = server.address[1]
    left = Page(page.driver, server, page.station)
    left.show(size)
    left.take()
    until(lambda: "This page holds control" in left.text("#holder"))
    server.stop()
    until(lambda: "no connection" in left.text("#alarm-list"))
    assert left.text("#holder") == "" and left.text("#trust") == ""
    for button, words in (("#stop", "STOP NOT"), ("#emergency", "EMERGENCY STOP NOT")):
        left.find(button).click()
        left.says(f"{words} CONFIRMED: no connection. Use the machine's own switch.")
    with WebServer(page.station, port=port, folder=profile):
        until(lambda: left.text("#link") == "connected")
        left.says("Connected again.")
        assert "NOT CONFIRMED" not in left.text("#status")
    left.shape(DESK)


def test_a_page_of_a_machine_that_starts_waits_for_it(
    driver: Any, fake: Any, tmp_path: Path
) -> None:
    fake.started = False
    with WebServer(fake, port=0, folder=tmp_path) as server:
        page = Page(driver, server, fake)
        driver.get(server.url)
        until(lambda: page.text("#link") == "starting")
        assert "The machine is starting; nothing moves." in page.text("#alarm-list")
        fake.started = True
        until(lambda: page.text("#link") == "connected")
        until(lambda: "starting" not in page.text("#alarm-list"))
        assert page.text("#status") == ""


def test_an_emergency_stop_does_not_wait_for_the_next_try(page: Page, profile: Path) -> None:
    """The server is back, the page has not noticed yet: the stop itself connects."""
    server = WebServer(page.station, port=0, folder=profile)
    server.start()
    port = server.address[1]
    left = Page(page.driver, server, page.station)
    left.show()
    left.run("window.setTimeout = () => 0")  # no try by itself
    server.stop()
    until(lambda: left.text("#link") == "no connection")
    with WebServer(page.station, port=port, folder=profile):
        before = page.station.snapshot().emergency_s
        left.find("#emergency").click()
        left.says("Emergency stop: outputs off")
        after = page.station.snapshot().emergency_s
        assert after != before and math.isfinite(after)
        assert left.text("#link") == "connected"
