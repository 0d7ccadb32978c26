"""The page in a real browser, before the virtual bench."""

from __future__ import annotations

import functools
import http.server
import itertools
import math
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from page_parts import Page

from macromicro.control.live import messages as m
from macromicro.control.live.transitions import STOP
from macromicro.serve.shared import INDEX
from macromicro.serve.web import WebServer
from tests.browser import DESK, LEAST_CONTRAST, PHONE, TEXTS, WIDER, contrast, luminance
from tests.waiting import until

FOCUSED = """
const e = document.activeElement, s = getComputedStyle(e), b = e.getBoundingClientRect();
return [e.id || e.dataset.do || e.getAttribute('aria-label') || e.tagName,
        parseFloat(s.outlineWidth), s.outlineStyle, b.width * b.height,
        e.matches(':focus-visible')];
"""


def rows(page: Page) -> dict[str, Any]:
    _, block, _ = page.station.telemetry()
    return {name: block[k] for name, k in INDEX.items()}


def test_a_move_by_click_arrives(ready: Page) -> None:
    place = 42.1234 if abs(ready.station.snapshot().position_m - 0.04) > 0.005 else 62.1234
    motion = ready.move(place)
    assert ready.outcome(motion) == m.DONE
    ready.says("arrived and settled")
    until(lambda: ready.text("#mode") == "holding")
    shown = float(ready.text("#position").split()[0])
    assert shown == pytest.approx(place, abs=0.05)
    assert ready.text("#target") == f"{place:.4f} mm"
    told = ready.text("#uncertainty")  # by laser: homing has placed the encoder's edges
    assert told.endswith("mm either way") and 7e-3 < float(told.split()[1]) < 20e-3


def test_a_machine_of_one_stage_shows_that_one(driver: Any, fake: Any, tmp_path: Path) -> None:
    """Read-out, jog and kinds of moves of the other one are gone."""
    fake.stages = (m.MACRO,)
    shown = (
        "return [...document.querySelectorAll('[data-of=%s]')]"
        ".map(e => getComputedStyle(e).display)"
    )
    with WebServer(fake, port=0, folder=tmp_path) as server:
        page = Page(driver, server, fake)
        page.show()
        until(lambda: set(page.run(shown % "micro")) == {"none"})
        assert len(page.run(shown % "micro")) == 8 and "none" not in page.run(shown % "macro")
        assert page.run(shown.replace("%s", '"macro micro"')) == ["none"]
        assert page.run("return document.querySelector('#move-kind').options[0].text") == (
            "Position, to"
        )
        until(lambda: page.text("#limits").startswith("Soft limits: "))
        assert "stage" not in page.text("#limits")


@pytest.mark.parametrize("how", ["click", "key"])
def test_an_emergency_stop_mid_move(ready: Page, how: str, record_property: Any) -> None:
    here = ready.station.snapshot().position_m
    motion = ready.move(90.0 if here < 0.045 else 5.0)
    ready.moving()
    if how == "click":
        ready.click("#emergency")
    else:
        ready.keys("\ue00c")  # Escape, while the focus is where it is
    assert ready.outcome(motion) == m.EMERGENCY
    until(lambda: ready.run("return window.macromicro.emergencyMs > 0"))
    seen = rows(ready)
    safe = np.flatnonzero(seen["mode"] == m.DISABLED)
    last = np.flatnonzero(seen["mode"] != m.DISABLED)[-1]
    # From the first period that knew of it on, no output was anything but safe.
    after = safe[safe > last]
    assert after.size > 0 and after[0] == last + 1
    for output in ("motor", "ctrl", "fan"):
        assert not seen[output][after].any()
    loop_ms = ready.station.snapshot().emergency_s * 1e3
    click_ms = ready.run("return window.macromicro.emergencyMs")
    record_property("emergency_loop_ms", loop_ms)
    record_property("emergency_click_ms", click_ms)
    print(f"emergency by {how}: safe {loop_ms:.2f} ms after the server, {click_ms:.1f} ms in all")
    until(lambda: "not known" in ready.text("#alarm-list"))
    assert "home" in ready.text("#alarm-list")


def test_a_reload_loses_nothing(ready: Page) -> None:
    here = ready.station.snapshot().position_m
    motion = ready.move(90.0 if here < 0.045 else 5.0)
    ready.moving()
    holder = ready.station.snapshot().holder
    ready.reload()
    now = ready.station.snapshot()
    assert (now.motion, now.holder) == (motion, holder)
    until(lambda: f"motion {motion}" in ready.text("#mode"))
    until(lambda: "This page holds control" in ready.text("#holder"))
    until(lambda: "macro move" in ready.text("#events"))
    assert ready.outcome(motion) == m.DONE
    until(lambda: ready.text("#mode") == "holding")
    target = ready.text("#target")
    ready.reload()  # at rest: target, position and what happened are there again
    until(lambda: ready.text("#target") == target)
    until(lambda: f"motion {motion} arrived" in ready.text("#events"))
    seen = rows(ready)["position"][-1]
    assert float(ready.text("#position").split()[0]) == pytest.approx(seen, abs=0.05)


@pytest.mark.parametrize("size", [DESK, pytest.param(PHONE, marks=pytest.mark.slow)])
def test_nothing_moves_under_the_finger(ready: Page, size: tuple[int, int]) -> None:
    """Alarms, replies and states change; what can be pressed stays where it is."""
    ready.shape(size, "light")
    selectors = ["#take", "#release", "[data-do=enable]", "[data-do=home]", "#move", "#run",
                 ".jog-button", "#stop", "#emergency"]  # fmt: skip

    def places() -> list[float]:
        found: list[float] = ready.run(
            """return arguments[0].map((s) => {
                 const box = document.querySelector(s).getBoundingClientRect();
                 const fixed = s === "#stop" || s === "#emergency";
                 return Math.round(box.top + (fixed ? 0 : scrollY));
               })""",
            selectors,
        )
        return found

    until(lambda: ready.text("#trust") == "position trusted")
    time.sleep(0.5)  # a resized page asks for other plots
    quiet = places()
    here = ready.station.snapshot().position_m
    motion = ready.move(90.0 if here < 0.045 else 5.0)
    ready.moving()
    assert places() == quiet
    ready.click("#emergency")
    assert ready.outcome(motion) == m.EMERGENCY
    until(lambda: "not known" in ready.text("#alarm-list"))
    ready.says("Emergency stop: outputs off")
    assert places() == quiet
    ready.click("[data-do=enable]")
    ready.find("#move-value").clear()
    ready.click("#move")  # refused: no number
    until(lambda: ready.text("#move-problem"))
    assert places() == quiet
    ready.shape(DESK, "light")


def test_the_space_bar_stops_wherever_the_focus_is(ready: Page) -> None:
    """Also in the target's field, in which a motion is ordered, and in one of words."""
    words = "document.body.append(Object.assign(document.createElement('input'), {id: 'words'}))"
    ready.run(words)
    for field in ("#move-value", "#words", "#fan"):
        here = ready.station.snapshot().position_m
        ready.find("#move-value").clear()
        ready.find("#move-value").send_keys(f"{190.0 if here < 0.1 else 5.0:.6f}")
        # In one go, and far: the browser may need as long for a step as the carriage for its way.
        focus = f"document.querySelector('{field}').focus()"
        ready.run(f"document.querySelector('#move').click(); {focus}")
        motion = ready.begun()
        ready.moving()
        ready.keys(" ")
        # On a busy computer the carriage may come to rest later than the loop waits for it,
        # or the micro-stage was moving already, which needs no way to stop.
        ended = ready.ended(motion)
        assert ended.outcome == m.STOPPED_BY_REQUEST or ended.evidence.get("cause") == STOP, ended
    assert " " not in ready.find("#move-value").get_attribute("value")
    assert ready.find("#words").get_attribute("value") == " "
    rests = ready.station.events()[0]
    ready.run("document.querySelector('#words').focus()")
    ready.keys(" x")
    assert ready.find("#words").get_attribute("value") == "  x"
    assert ready.station.events(rests)[1] == []  # at rest it is a letter alone
    ready.run("document.querySelector('#words').remove()")
    assert not ready.station.snapshot().fan  # it pressed no button
    assert ready.station.snapshot().trusted


def test_an_emergency_stop_lets_a_held_jog_go(ready: Page) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    here = ready.station.snapshot().position_m
    sign = "1" if here < 0.1 else "-1"
    button = ready.find(f".jog[data-stage=macro] .jog-button[data-sign='{sign}']")
    ActionChains(ready.driver).click_and_hold(button).perform()
    motion = ready.begun()
    ready.keys("\ue00c")
    assert ready.outcome(motion) == m.EMERGENCY
    assert "held" not in button.get_attribute("class")
    sent = """const put = WebSocket.prototype.send, seen = [], done = arguments[0];
      WebSocket.prototype.send = function (text) { seen.push(text); return put.call(this, text); };
      setTimeout(() => { WebSocket.prototype.send = put; done(seen.join()); }, 600);"""
    assert '"keep"' not in ready.driver.execute_async_script(sent)
    ActionChains(ready.driver).release(button).perform()


def test_a_jog_lasts_as_long_as_its_button_is_held(ready: Page) -> None:
    from selenium.webdriver.common.action_chains import ActionChains

    here = ready.station.snapshot().position_m
    sign = "1" if here < 0.1 else "-1"
    button = ready.find(f".jog[data-stage=macro] .jog-button[data-sign='{sign}']")
    ActionChains(ready.driver).click_and_hold(button).perform()
    motion = ready.begun()
    start = ready.station.snapshot().macro_count
    until(lambda: abs(ready.station.snapshot().macro_count - start) > 40)
    assert ready.station.finished(motion, 0.0) is None
    ActionChains(ready.driver).release(button).perform()
    assert ready.outcome(motion) == m.STOPPED_BY_REQUEST
    # The micro-stage, by keyboard: Enter is held and let go.
    ready.run("document.querySelector('.jog[data-stage=micro] [data-sign=\"1\"]').focus()")
    enter = {"key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13}
    ready.command("Input.dispatchKeyEvent", type="keyDown", **enter)
    motion = ready.begun()
    until(lambda: ready.station.snapshot().micro_reference_m > 0.05e-3)
    ready.command("Input.dispatchKeyEvent", type="keyUp", **enter)
    assert ready.outcome(motion) == m.STOPPED_BY_REQUEST


def test_a_slip_is_told_and_moves_nothing(ready: Page) -> None:
    for text, words in (("5000", "5000 is outside"), ("4x", "number"), ("", "number")):
        field = ready.find("#move-value")
        field.clear()
        field.send_keys(text)
        ready.click("#move")
        assert words in ready.text("#move-problem")
        assert ready.find("#move-value").get_attribute("aria-invalid") == "true"
    assert ready.station.snapshot().motion == 0


@pytest.mark.slow
def test_by_keyboard_alone(ready: Page) -> None:
    ready.click("#release")
    until(lambda: ready.station.snapshot().holder == "")
    ready.show()
    tab, enter = "\ue004", "\ue007"
    order: list[str] = []

    def walk(to: str) -> None:
        for _ in range(60):
            ready.keys(tab)
            name, width, style, area, visible = ready.run(FOCUSED)
            order.append(name)
            assert visible and area > 0 and width >= 2 and style != "none", name
            if name == to:
                return
        raise AssertionError(f"{to} cannot be reached: {order}")

    walk("take")
    ready.keys(enter)
    until(lambda: ready.station.snapshot().holder.startswith("web"))
    until(lambda: ready.find("#move").is_enabled())
    walk("move-value")
    place = ready.station.snapshot().position_m * 1e3 + 2.0
    ready.keys(f"{place:.3f}", enter)
    assert ready.outcome(ready.begun()) == m.DONE
    walk("run")
    ready.keys(enter)
    motion = ready.begun()
    ready.moving()
    walk("stop")
    ready.keys(enter)
    assert ready.outcome(motion) == m.STOPPED_BY_REQUEST
    walk("emergency")
    assert len(set(order)) > 15


def test_gains_are_shown_as_changes_before_they_apply(ready: Page) -> None:
    wait = next(e for e in ready.run(GAINS) if e[0] == "sequence.wait")
    ready.unfold("#gains")
    field = ready.find("input[aria-label='sequence.wait']")
    for bad in ("-1", "x"):
        field.clear()
        field.send_keys(bad)
        ready.click("#review")
        assert "sequence.wait" in ready.text("#gains-problem")
    field.clear()
    field.send_keys("0.75")
    ready.click("#review")
    assert ready.run("return document.querySelector('#diff').open")
    shown = ready.text("#diff-rows")
    assert "sequence.wait" in shown and wait[1] in shown and "0.75 s" in shown
    assert not [e for e in ready.station.events()[1] if e.kind == "gains"]
    ready.click("#apply")
    ready.says("Settings: done")
    told = [e for e in ready.station.events()[1] if e.kind == "gains"][-1]
    assert told.evidence["sequence.wait"] == {"old": float(wait[1]), "new": 0.75}
    until(lambda: ready.run("return document.querySelectorAll('tr.changed').length") == 0)
    assert next(e for e in ready.run(GAINS) if e[0] == "sequence.wait")[1] == "0.75"


GAINS = """
return [...document.querySelectorAll('#gains-rows tr')].map(
  r => [r.cells[0].textContent, r.querySelector('input, select').value]);
"""


def test_a_recording_is_made_and_handed_out(ready: Page, profile: Path) -> None:
    ready.click("#record")
    until(lambda: ready.station.snapshot().recording.rows > 100)
    until(lambda: ready.text("#record") == "End the recording")
    ready.click("#record")
    until(lambda: "Download" in ready.text("#recordings"))
    path = Path(ready.station.snapshot().recording.path)
    assert path.parent == profile
    size = ready.driver.execute_async_script(
        "const done = arguments[arguments.length - 1], make = URL.createObjectURL;"
        "URL.createObjectURL = b => { done(b.size); return make.call(URL, b); };"
        "document.querySelector('#recordings button').click();"
    )
    assert size == path.stat().st_size


def test_nothing_is_wider_than_the_screen(page: Page) -> None:
    page.show()
    for size in (PHONE, DESK):
        page.shape(size)
        page.run("document.querySelectorAll('details').forEach(d => d.open = true)")
        assert page.run(WIDER)[0] <= 0  # at once
        until(lambda: page.run(WIDER)[1] == [])  # the curves follow with the next frame
        stops = page.run(
            "return ['stop', 'emergency'].map(i => { const b = document.getElementById(i)"
            ".getBoundingClientRect(); return [b.left, b.right, b.top, b.bottom, b.height]; })"
        )
        for left, right, top, bottom, height in stops:  # in reach without scrolling
            assert 0 <= left < right <= size[0] and 0 <= top < bottom <= size[1] and height >= 60


def test_text_stands_out(page: Page) -> None:
    page.station.emergency()
    page.show()
    page.run(
        "document.querySelectorAll('details, #login').forEach(d => d.open = !(d.hidden = false))"
    )
    until(lambda: page.text("#gains-rows"))
    for scheme in ("light", "dark"):
        page.shape(scheme=scheme)
        texts = page.run(TEXTS)
        kinds = " ".join(name for _, _, name in texts)
        assert "EMERGENCY" in kinds and "badge" in kinds and "faint" in kinds
        faint = [(name, contrast(c, b)) for c, b, name in texts if contrast(c, b) < LEAST_CONTRAST]
        assert faint == []
        paper = page.run("return getComputedStyle(document.body).backgroundColor")
        colour = [float(v) for v in paper.strip("rgb()").split(",")]
        assert (luminance(colour) < 0.05) == (scheme == "dark")


def test_it_draws_what_comes_and_has_no_errors(page: Page) -> None:
    page.show()
    until(lambda: page.run("return window.macromicro.drawn") > 20)
    inked = page.run(
        "return [...document.querySelectorAll('canvas')].filter(c => c.checkVisibility())"
        ".map(c => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(v => v > 0))"
    )
    assert len(inked) == 6 and all(inked)
    origins = page.run(
        "return performance.getEntriesByType('resource').map(e => new URL(e.name).origin)"
    )
    assert sorted(set(origins)) == [page.server.url.rstrip("/")]
    assert page.problems() == []
    live = page.run(
        "return ['alarm-list', 'status'].map(i => document.getElementById(i).getAttribute('role'))"
    )
    assert live == ["alert", "status"]


def test_alarms_are_told_once_with_their_remedy(page: Page) -> None:
    """The list is touched only where its words change: a screen reader does not repeat it."""
    page.station.emergency()
    page.show()
    page.run(
        "window.touched = 0; new MutationObserver(() => window.touched++)"
        ".observe(document.getElementById('alarm-list'), {childList: true, subtree: true})"
    )
    frames = page.run("return window.macromicro.frames")
    until(lambda: page.run("return window.macromicro.frames") > frames + 10)
    assert page.run("return window.touched") == 0


SOCKET = """
const done = arguments[arguments.length - 1], socket = new WebSocket(arguments[0]);
socket.onopen = () => { socket.send('{"do": "emergency"}'); done('open'); };
socket.onerror = () => done('refused');
"""


def test_a_page_of_another_origin_commands_nothing(page: Page, tmp_path: Path) -> None:
    (tmp_path / "index.html").write_text("<!DOCTYPE html><title>elsewhere</title>")
    quiet = functools.partial(_Quiet, directory=str(tmp_path))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), quiet) as other:
        thread = threading.Thread(target=other.serve_forever, daemon=True)
        thread.start()
        page.driver.get(f"http://127.0.0.1:{other.server_port}/")
        url = page.server.url.replace("http", "ws") + "live"
        before = page.station.snapshot().emergency_s
        assert page.driver.execute_async_script(SOCKET, url) == "refused"
        after = page.station.snapshot().emergency_s
        assert before == after or (math.isnan(before) and math.isnan(after))
        # Nor is the page itself shown in a frame there.
        framed = page.driver.execute_async_script(
            "const done = arguments[arguments.length - 1], f = document.createElement('iframe');"
            "f.onload = () => { let seen = 'hidden'; try { seen = f.contentDocument.title; }"
            " catch (e) {} done(seen); }; f.src = arguments[0]; document.body.append(f);",
            page.server.url,
        )
        assert "Positioner" not in framed
        other.shutdown()
        thread.join()
    page.show()
    assert page.driver.execute_async_script(SOCKET, url) == "open"  # the check can fail


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format: str, *arguments: Any) -> None:
        pass


def test_a_token_is_asked_for_once_and_never_in_an_address(page: Page, profile: Path) -> None:
    with WebServer(page.station, port=0, token="open sesame", folder=profile) as server:
        guarded = Page(page.driver, server, page.station)
        guarded.show()
        assert not guarded.find("#take").is_enabled()
        assert guarded.find("#login").is_displayed() and guarded.find("#stop").is_enabled()
        guarded.find("#token").send_keys("sesame")
        guarded.click("#login-form button")
        guarded.says("not the token")
        guarded.find("#token").clear()
        guarded.find("#token").send_keys("open sesame")
        guarded.click("#login-form button")
        guarded.says("Logged in")
        guarded.reload()
        until(lambda: guarded.find("#take").is_enabled())
        assert not guarded.find("#login").is_displayed()
        addresses = guarded.run(
            "return [location.href, ...performance.getEntriesByType('resource').map(e => e.name)]"
        )
        assert not [a for a in addresses if "sesame" in a]
        assert guarded.run("return [localStorage.length, document.cookie]") == [0, ""]


def test_the_page_tells_when_the_server_is_gone_and_comes_back(page: Page, profile: Path) -> None:
    server = WebServer(page.station, port=0, folder=profile)
    server.start()
    port = server.address[1]
    left = Page(page.driver, server, page.station)
    left.show()
    server.stop()
    until(lambda: "no connection" in left.text("#alarm-list"))
    assert left.text("#mode") == "unknown"
    assert "stale" in left.find("#reading").get_attribute("class")
    assert left.text("#uncertainty").startswith("OLD")
    with WebServer(page.station, port=port, folder=profile):
        until(lambda: left.text("#link") == "connected")
        until(lambda: "no connection" not in left.text("#alarm-list"))


@pytest.mark.slow
def test_a_picture_of_it_is_kept(page: Page, tmp_path: Path) -> None:
    page.show()
    for size, scheme in itertools.product((PHONE, DESK), ("light", "dark")):
        page.shape(size, scheme)
        drawn = page.run("return window.macromicro.drawn")
        until(lambda drawn=drawn: page.run("return window.macromicro.drawn") > drawn + 5)
        place = tmp_path / f"serve-{size[0]}-{scheme}.png"
        page.picture(place)
        header = place.read_bytes()[:24]
        assert header.startswith(b"\x89PNG") and int.from_bytes(header[16:20], "big") == size[0]


@pytest.mark.slow
def test_memory_stays_flat(ready: Page, record_property: Any) -> None:
    """Once its curves are full, the page holds after a minute of frames what it held before."""

    def held() -> float:
        ready.command("HeapProfiler.collectGarbage")
        return float(ready.command("Runtime.getHeapUsage")["usedSize"])

    def frames() -> list[float]:
        found: list[float] = ready.run(
            "return [macromicro.frames, macromicro.drawn, performance.now()]"
        )
        return found

    ready.command("HeapProfiler.enable")
    heap = [held()]
    while len(heap) < 2 or (heap[-1] - heap[-2] > 5e5 and len(heap) < 6):
        start = frames()
        time.sleep(60.0)  # each look would leave something of its own in the browser
        end = frames()
        heap.append(held())
    seconds = (end[2] - start[2]) / 1e3
    rates = [(end[k] - start[k]) / seconds for k in (0, 1)]
    print(f"{rates[0]:.1f} frames/s, {rates[1]:.1f} drawn/s, heap of each minute: {heap} bytes")
    record_property("frames_per_s", rates[0])
    assert end[0] - start[0] > 300
    assert heap[-1] - heap[-2] < 5e5  # one more array per frame would be 100 times that
