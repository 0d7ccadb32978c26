"""The page in a browser, with the station behind it, for tests."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from macromicro.control.live import messages as m
from macromicro.serve.settings import load
from macromicro.serve.station import Station
from macromicro.serve.web import WebServer
from macromicro.serve.web.server import Bounds
from tests.browser import DESK, Window
from tests.waiting import until

# The tests' browser draws on the processor: a third of the usual frames.
SPARING = Bounds(frames=10.0)

# In control by a sound connection: so the page is when a test has ended.
OURS = """
return location.href === arguments[0] && Boolean(window.macromicro?.state().mode)
  && document.querySelector('#link').textContent === 'connected'
  && document.querySelector('#holder').textContent.includes('This page holds control');
"""
# Nothing typed, told or open any more.
TIDY = """
document.querySelector('#diff').open && document.querySelector('#cancel').click();
document.querySelector('#revert').click();
document.querySelectorAll('details').forEach(e => { e.open = false; });
document.querySelectorAll('#move-value, #status, #move-problem, #gains-problem, #limits-problem')
  .forEach(e => { e[e.tagName === 'INPUT' ? 'value' : 'textContent'] = ''; });
document.activeElement.blur();
scrollTo(0, 0);
macromicro.emergencyMs = 0;
"""


class Page(Window):
    """The page and the station behind it."""

    def __init__(self, driver: Any, server: WebServer, station: Station) -> None:
        super().__init__(driver)
        self.server, self.station = server, station
        self.last = 0  # the newest motion that a test knows of

    def show(self, size: tuple[int, int] = DESK, scheme: str = "light") -> None:
        """Load the page anew, as a new viewer."""
        self.shape(size, scheme)
        # Where the page itself is not, which would keep its session.
        self.driver.get(self.server.url + "icon.svg")
        self.run("sessionStorage.clear()")
        self.driver.get_log("browser")
        self.driver.get(self.server.url)
        self.shown()

    def reload(self) -> None:
        self.driver.refresh()
        self.shown()

    def shown(self) -> None:
        until(lambda: self.run("return Boolean(window.macromicro?.state().mode)"))

    def problems(self) -> list[str]:
        """What the browser has logged; for a picture alone it asks for an icon of its own."""
        said = [str(entry["message"]) for entry in self.driver.get_log("browser")]
        return [words for words in said if "favicon" not in words]

    def find(self, selector: str) -> Any:
        return self.driver.find_element("css selector", selector)

    def text(self, selector: str) -> str:
        return str(self.run("return document.querySelector(arguments[0]).textContent", selector))

    def click(self, selector: str) -> None:
        element = self.find(selector)
        self.run("arguments[0].scrollIntoView({block: 'center'})", element)
        element.click()

    def unfold(self, selector: str) -> None:
        """Open a folding part; whoever missed it, as the page moved just then, presses again."""
        folding = f"return document.querySelector('{selector} summary').parentElement.open"
        until(lambda: self.run(folding) or self.click(f"{selector} summary"))

    def keys(self, *keys: str) -> None:
        self.driver.switch_to.active_element.send_keys(*keys)

    def says(self, words: str) -> None:
        """Wait until the status line says so."""
        try:
            until(lambda: words in self.text("#status"))
        except AssertionError:
            raise AssertionError(f"not {words!r} but {self.text('#status')!r}") from None

    def move(self, millimetres: float) -> int:
        """Order a move by mouse; its number."""
        field = self.find("#move-value")
        field.clear()
        field.send_keys(f"{millimetres:.6f}")
        before = self.station.events()[0]
        self.click("#move")
        return self.begun(before)

    def begun(self, since: int | None = None) -> int:
        """Wait until a motion is under way that was not asked for before; its number.

        The one before may still stand in the snapshot when its end has been told. With `since`, a
        place in the events, one of milliseconds is found that has ended between two looks.
        """
        seen = (0, self.last)

        def new() -> int:
            now = self.station.snapshot().motion
            events = [] if since is None else self.station.events(since)[1]
            ended = [each.id for each in events if isinstance(each, m.Finished)]
            return next((number for number in (now, *ended) if number not in seen), 0)

        self.last = int(until(new))
        return self.last

    def moving(self) -> None:
        """Wait until the carriage moves in earnest."""
        until(lambda: self.station.snapshot().mode == "moving-macro")
        start = self.station.snapshot().macro_count
        until(lambda: abs(self.station.snapshot().macro_count - start) > 20)

    def outcome(self, motion: int) -> str:
        return self.ended(motion).outcome

    def ended(self, motion: int) -> m.Finished:
        def end() -> m.Finished | None:
            self.station.heartbeat("test")
            return self.station.finished(motion, 0.01)

        found: m.Finished = until(end)
        return found

    def free(self) -> None:
        """Nobody holds control, and nothing moves: a stop at rest loses no position."""
        self.station.release(self.station.snapshot().holder)
        self.station.request("test", m.Stop())
        until(lambda: self.station.snapshot().motion == 0)

    def ready(self) -> None:
        """In control of a machine that is homed and enabled, where it stands; by orders to the
        page as it is, or else as a new viewer."""
        now = self.station.snapshot()
        whole = now.running and now.trusted and now.fault is None and now.holder.startswith("web")
        if whole and self.run(OURS, self.server.url):
            self.shape()
            for order in (m.Stop(), m.Disable(), m.Enable()):
                self.station.request(now.holder, order)
                until(lambda: self.station.snapshot().motion == 0)
            until(lambda: self.station.snapshot().mode == "ready")
            frames = self.run("return macromicro.frames")
            until(lambda: self.run("return macromicro.frames") > frames + 2)
            self.run(TIDY)
        else:
            self.anew()
        until(lambda: self.find("#move").is_enabled())

    def anew(self) -> None:
        """A new viewer in control of the machine, homed and enabled."""
        self.free()
        self.station.emergency()
        self.show()
        now = self.station.snapshot()
        assert (now.mode, now.fault) == ("disabled", None)
        assert self.station.acquire("test") == m.Accepted()
        self.station.request("test", m.Enable())
        if not self.station.snapshot().trusted:
            reply = self.station.request("test", m.Home())
            assert isinstance(reply, m.Accepted) and self.outcome(reply.id) == m.DONE
        self.station.disconnect("test")
        until(lambda: self.station.snapshot().mode in ("ready", "stopped"))
        self.last = 0
        self.take()

    def take(self) -> None:
        """Take control; whoever sees no effect within a second presses again."""

        def held() -> bool:
            return self.station.snapshot().holder.startswith("web")

        def pressed() -> bool:
            if not held() and self.find("#take").is_enabled():
                self.click("#take")
            patience = time.monotonic() + 1.0
            while not held() and time.monotonic() < patience:
                time.sleep(0.01)
            return held()

        until(pressed)
        # The page hears of it later than the station; until then its orders are disabled.
        until(lambda: not self.find("#take").is_enabled())


@contextmanager
def opened(driver: Any, file: Path, folder: Path) -> Iterator[Page]:
    """The page of the machine in a file."""
    settings = load(file)
    patient = settings.serve._replace(miss_share=1.0, loop_timeout=5.0, parent_timeout=5.0)
    station = Station(settings=settings._replace(serve=patient), state=folder / "p.json")
    with station, WebServer(station, port=0, folder=folder, bounds=SPARING) as server:
        page = Page(driver, server, station)
        page.show()
        yield page


SAVED = """
const done = arguments[arguments.length - 1], make = URL.createObjectURL;
URL.createObjectURL = (blob) => {
  blob.text().then(done);
  URL.createObjectURL = make;
  return make.call(URL, blob);
};
document.querySelector(arguments[0]).click();
"""


def saved(page: Page, selector: str) -> str:
    """The text of the file that a button hands to the browser."""
    return str(page.driver.execute_async_script(SAVED, selector))
