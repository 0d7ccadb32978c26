"""A real browser for tests: Debian's chromium with its driver, headless and without a network.

Without a browser such tests are skipped, or fail where MACROMICRO_BROWSER is "required".
"""

from __future__ import annotations

import base64
import os
import shutil
from pathlib import Path
from typing import Any

import pytest

PHONE, DESK = (360, 740), (1280, 900)
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
)
LEAST_CONTRAST = 4.5  # WCAG 2.2, success criterion 1.4.3
# Every element that holds text of its own, in colours over the nearest opaque background.
TEXTS = """
const parse = c => (c.match(/[0-9.]+/g) || []).map(Number);
const found = [];
for (const e of document.body.querySelectorAll('*')) {
  const own = [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
  const hidden = !e.checkVisibility() || e.closest('svg');
  if (!own || hidden || ['STYLE', 'SCRIPT'].includes(e.tagName)) continue;
  let back = e, colour;
  do {
    colour = parse(getComputedStyle(back).backgroundColor);
    back = back.parentElement;
  } while (back && colour.length === 4 && colour[3] === 0);
  found.push([parse(getComputedStyle(e).color).slice(0, 3), colour.slice(0, 3),
              e.className + ' ' + e.tagName + ' ' + e.textContent.trim().slice(0, 30)]);
}
return found;
"""
WIDER = """
const edge = document.documentElement.clientWidth, found = [];
for (const e of document.body.querySelectorAll('*')) {
  if (e.closest('.scroll, .frame, pre, .skip, svg') || !e.checkVisibility()) continue;
  if (e.getBoundingClientRect().right > edge + 0.5) found.push(e.outerHTML.slice(0, 120));
}
return [document.documentElement.scrollWidth - edge, found];
"""


def needed() -> None:
    """Skip, or fail, where there is no browser."""
    names = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None]
    if not names:
        return
    absent = f"no {' and no '.join(names)} here; `make browser` installs them"
    if os.environ.get("MACROMICRO_BROWSER") == "required":
        pytest.fail(absent)
    pytest.skip(absent)


def driver(profile: Path, hosts: str = "", rebound: str = "", *, network: bool = False) -> Any:
    """Chromium with the driver beside it; both named, so that nothing is looked for.

    `hosts`: the one host that can be reached, none by default; `rebound`: a name that somebody
    else's DNS leads to 127.0.0.1; `network`: log what goes over it, in the performance log.
    """
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    rules = f"MAP {rebound} 127.0.0.1, " if rebound else ""
    rules += "MAP * ~NOTFOUND" + (f", EXCLUDE {hosts}" if hosts else "")
    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    for flag in (*FLAGS, f"--host-resolver-rules={rules}", f"--user-data-dir={profile}"):
        options.add_argument(flag)
    logs = {"browser": "ALL"} | ({"performance": "ALL"} if network else {})
    options.set_capability("goog:loggingPrefs", logs)
    # The driver listens on this machine, which no proxy reaches.
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("no_proxy", "localhost,127.0.0.1")
        return webdriver.Chrome(options, Service(str(shutil.which("chromedriver"))))


class Window:
    """A window of the browser whose size and colour scheme are set."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def shape(self, size: tuple[int, int] = DESK, scheme: str = "light") -> None:
        """Size in CSS pixels; the scheme is "light" or "dark"."""
        width, height = size
        window = {"width": width, "height": height, "deviceScaleFactor": 1}
        self.command("Emulation.setDeviceMetricsOverride", mobile=size == PHONE, **window)
        feature = {"name": "prefers-color-scheme", "value": scheme}
        self.command("Emulation.setEmulatedMedia", media="screen", features=[feature])

    def command(self, name: str, **parameters: Any) -> Any:
        return self.driver.execute_cdp_cmd(name, parameters)

    def run(self, script: str, *arguments: Any) -> Any:
        return self.driver.execute_script(script, *arguments)

    def picture(self, place: Path) -> None:
        shot = self.command("Page.captureScreenshot", format="png")
        place.write_bytes(base64.b64decode(shot["data"]))


def contrast(one: list[float], other: list[float]) -> float:
    """Contrast ratio of two sRGB colours, 0-255 (WCAG 2.2)."""
    light, dark = sorted((luminance(one), luminance(other)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def luminance(colour: list[float]) -> float:
    """Relative luminance of an sRGB colour, 0-255."""
    parts = [v / 255.0 for v in colour]
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
