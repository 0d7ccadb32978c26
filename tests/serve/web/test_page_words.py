"""What the page shows and tells: limits in force, recordings of others, scales, live regions."""

from __future__ import annotations

import itertools
import time
from pathlib import Path

import pytest
from page_parts import Page
from web_parts import Client, Station

from macromicro.control.live import messages as m
from macromicro.serve.snapshot import Trouble
from macromicro.serve.web import WebServer
from tests.browser import DESK, PHONE
from tests.waiting import until

LIVE = """
window.told = 0;
const live = [...document.querySelectorAll('output, [role=status], [role=alert], [role=log],'
  + '[aria-live=polite], [aria-live=assertive]')].filter(e => e.ariaLive !== 'off');
window.watches?.forEach(w => w.disconnect());
window.watches = live.map(() => new MutationObserver(() => window.told++));
const all = {childList: true, subtree: true, characterData: true};
live.forEach((e, k) => window.watches[k].observe(e, all));
return live.length;
"""
TICKS = """
const c = document.querySelector('#ruler'), scale = c.width / c.clientWidth;
const y = Math.round((c.clientHeight * 7 / 8 + 2) * scale);
const line = c.getContext('2d').getImageData(0, y, c.width, 1).data, found = [];
for (let x = Math.floor(55 * scale); x < c.width; x++) { // right of the scale's name
  const dark = line[4 * x + 3] > 60;
  if (dark && !found.inside) found.push(x / scale);
  found.inside = dark;
}
return [...found];
"""


def test_narrowed_limits_are_shown_and_kept(ready: Page) -> None:
    station = ready.station
    holder = station.snapshot().holder
    own = station.settings.live.limits
    narrow = own._replace(whole_low=0.02, whole_high=0.03, macro_low=300.0, macro_high=400.0)
    try:
        assert station.request(holder, m.SetLimits(narrow)) == m.Accepted()
        until(lambda: "20 to 30 mm" in ready.text("#limits"))
        assert "300 to 400 counts" in ready.text("#limits")
        field = ready.find("#move-value")
        field.clear()
        field.send_keys("45")
        ready.click("#move")
        assert ready.text("#move-problem") == "45 is outside 20 to 30 mm."
        # A page that does not look is refused by the machine, in words for this page.
        client = Client(ready.server.address[1], {"session": _session(ready)})
        reply = client.order("move to", value=45.0, unit="mm")
        client.close()
        assert not reply["ok"] and "45" in reply["reason"] and reply["remedy"]
        assert station.snapshot().motion == 0
    finally:
        station.request(holder, m.SetLimits(None))


def _session(page: Page) -> str:
    return str(page.run("return sessionStorage.getItem('macromicro.session')"))


@pytest.mark.parametrize("size", [PHONE, DESK])
def test_the_finest_scale_has_a_tick_for_each_micrometre(
    ready: Page, size: tuple[int, int]
) -> None:
    ready.shape(size)
    until(lambda: ready.run("return document.querySelector('#ruler').clientWidth") <= size[0])
    frames = ready.run("return macromicro.drawn")
    until(lambda: ready.run("return macromicro.drawn") > frames + 3)
    ticks = ready.run(TICKS)
    inner = ready.run("return document.querySelector('#ruler').clientWidth") - 56 - 8
    gaps = [b - a for a, b in itertools.pairwise(ticks)]
    assert 10 <= len(ticks) <= 12  # 10 um, and the target's line
    assert max(gaps) <= inner / 10 + 1.5
    ready.shape(DESK)


def test_nothing_that_goes_on_by_itself_is_read_aloud(ready: Page) -> None:
    """Numbers change ten times a second: no live region is among them."""
    time.sleep(0.5)
    assert ready.run(LIVE) >= 2
    position = ready.text("#position")
    frames = ready.run("return macromicro.frames")
    until(lambda: ready.run("return macromicro.frames") > frames + 13)
    until(lambda: ready.text("#position") != position)
    assert ready.run("return window.told") == 0


def test_a_download_is_told_at_its_beginning_and_end(
    ready: Page, profile: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("macromicro.serve.web._downloads.PIECE", 2000)
    station = ready.station
    path = profile / "elsewhere" / "by-another-client.h5"
    path.parent.mkdir(exist_ok=True)
    station.record(path, overwrite=True)
    until(lambda: station.snapshot().recording.rows > 300)
    station.end_recording()
    until(lambda: path.name in ready.text("#recordings"))
    ready.run(LIVE)
    ready.run(
        "[...document.querySelectorAll('#recordings button')]"
        ".find(b => b.textContent.includes(arguments[0])).click()",
        path.name,
    )
    ready.says("downloaded")
    assert path.stat().st_size > 20 * 2000
    assert ready.run("return window.told") <= 2


@pytest.mark.slow
def test_a_fault_of_a_loop_that_is_gone_cannot_be_cleared(page: Page, tmp_path: Path) -> None:
    fake = Station()
    fake.fault = Trouble(4, "encoder silent", "The encoder is silent.", "0.1 s", "See its plug.")
    fake.mode = "fault"
    with WebServer(fake, port=0, folder=tmp_path) as server:  # type: ignore[arg-type]
        shown = Page(page.driver, server, fake)
        shown.show()
        until(lambda: "encoder" in shown.text("#alarm-list"))
        assert shown.find("#clear").is_displayed()
        fake.running = False
        until(lambda: not shown.find("#clear").is_displayed())
        assert "encoder" in shown.text("#alarm-list")
