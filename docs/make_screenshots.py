"""Draws the pages as Chromium shows them: docs/figures/reproduction.png, the top of the page
that `macromicro reproduce` writes, and docs/figures/serve.png and serve-phone.png, the live page
after some moves of the virtual bench (needs selenium).

    python docs/make_screenshots.py [--quick: of the live page, into a folder that is deleted]
"""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

FIGURES = Path(__file__).resolve().parent / "figures"
PICTURE, LIVE = FIGURES / "reproduction.png", FIGURES / "serve.png"
PHONE = FIGURES / "serve-phone.png"
WIDTH, HEIGHT = 1280, 1500
MOVES = (
    ("move to", "42.1234"),
    ("move micro", "1.6"),
    ("move micro", "0.7"),
    ("move micro", "1.1"),
)


@contextlib.contextmanager
def browser() -> Iterator[Any]:
    """Chromium that can be driven, and reaches this computer only."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    rules = "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1"
    flags = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")
    with tempfile.TemporaryDirectory() as profile:
        more = ("--disable-dev-shm-usage", "--hide-scrollbars", f"--user-data-dir={profile}")
        for flag in (*flags, *more, rules, f"--window-size={WIDTH},{HEIGHT}"):
            options.add_argument(flag)
        driver = webdriver.Chrome(options, Service(str(shutil.which("chromedriver"))))
        try:
            yield driver
        finally:
            driver.quit()


def resized(driver: Any, width: int, height: int, scale: int, *, mobile: bool) -> None:
    """Show pages in so many pixels."""
    size = {"width": width, "height": height, "deviceScaleFactor": scale, "mobile": mobile}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


def reproduction(picture: Path) -> None:
    """A picture [PNG] of the first screen of the page that `macromicro reproduce` writes."""
    with tempfile.TemporaryDirectory() as folder, browser() as driver:
        out = Path(folder) / "reproduction"
        command = [sys.executable, "-m", "macromicro", "reproduce", "--out", str(out)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        resized(driver, WIDTH, HEIGHT, 1, mobile=False)
        driver.get((out / "reproduction.html").as_uri())
        driver.save_screenshot(str(picture))


def live(picture: Path, phone: Path) -> None:
    """Pictures [PNG] of the live page once it has homed the virtual bench and moved it; the
    other one on a phone, in the dark."""
    from macromicro.serve.station import Station
    from macromicro.serve.web import WebServer

    with tempfile.TemporaryDirectory() as folder, browser() as driver:
        station = Station(state=Path(folder) / "state.json")
        with station, WebServer(station, port=0, folder=Path(folder)) as server:
            driver.get(server.url)
            for button in ("#take", "[data-do=enable]", "[data-do=home]"):
                time.sleep(1.0)
                driver.find_element("css selector", button).click()
            for kind, value in MOVES:
                time.sleep(0.5)
                wait_for_rest(station)
                order = "arguments[0].value = arguments[1]"
                driver.execute_script(order, driver.find_element("id", "move-kind"), kind)
                field = driver.find_element("id", "move-value")
                field.clear()
                field.send_keys(value + "\n")
            time.sleep(0.5)
            wait_for_rest(station)
            time.sleep(0.5)
            driver.save_screenshot(str(picture))
            resized(driver, 360, 740, 2, mobile=True)
            dark = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
            driver.execute_cdp_cmd("Emulation.setEmulatedMedia", dark)
            driver.execute_script("document.querySelector('#signals').scrollIntoView()")
            time.sleep(3.0)
            driver.save_screenshot(str(phone))


def wait_for_rest(station: Any) -> None:
    """Wait until no motion is under way; RuntimeError after a minute."""
    for _ in range(600):
        if not station.snapshot().motion:
            return
        time.sleep(0.1)
    raise RuntimeError("the motion does not end")


def main() -> None:
    """Move the virtual bench, reproduce everything, and write the pictures."""
    if "--quick" in sys.argv:
        with tempfile.TemporaryDirectory() as scratch:
            live(Path(scratch) / LIVE.name, Path(scratch) / PHONE.name)
        return
    live(LIVE, PHONE)
    reproduction(PICTURE)


if __name__ == "__main__":
    main()
