"""The machine in a page: in Chromium, from a file and without a network, as in Python."""

from __future__ import annotations

import math
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.kernel import compiled
from tests import browser

DOCS = Path(__file__).parents[1] / "docs"
PERIOD, COUNT = 1e-3, 0.2 / 2800
# Period of a change, and set points of carriage [count] and micro-stage [m].
ORDERS = ((0, 840.0, 0.0), (3000, 840.0, 2e-3), (6500, 840.0, 1e-3), (8000, 500.0, 0.0))
PERIODS, EVERY = 10_000, 50
STEPPED = """
const [own, orders, periods, every, done] = arguments;
Machine.made().then(one => {
  const found = [];
  for (let k = 0; k < periods; k++) {
    for (const [at, carriage, micro] of orders) if (at === k) {
      one.set("aim.own", own); one.set("aim.carriage", carriage); one.set("aim.micro", micro);
    }
    one.step(1);
    if ((k + 1) % every === 0) found.push([one.get("true.carriage"), one.get("true.micro")]);
  }
  done(found);
});
"""


@pytest.fixture(scope="module")
def twin() -> Any:
    sys.path.insert(0, str(DOCS))
    yield import_module("twin")
    sys.path.remove(str(DOCS))


@pytest.fixture(scope="module")
def window(twin: Any, tmp_path_factory: pytest.TempPathFactory) -> Any:
    if find_spec("ziglang") is None:
        pytest.skip("the extra `cross` brings its compiler")
    browser.needed()
    place = tmp_path_factory.mktemp("twin") / "twin.html"
    text = import_module("make_twin").page()
    place.write_text(text, encoding="utf-8")
    assert len(text) < 1_000_000
    driver = browser.driver(place.parent / "profile")
    driver.set_script_timeout(120)
    driver.get(place.as_uri())
    window = browser.Window(driver)
    window.shape()
    yield window
    driver.quit()


def simulated(twin: Any, own: float) -> np.ndarray[Any, Any]:
    """Positions of carriage and micro-stage in Python."""
    unit = twin.unit()
    step, state, rows = compiled(twin.step), unit.state, []
    given = [unit.given[name] for name in ("plant", "thesis", "own", "plan")]
    aim = twin.Aim(0.0, 0.0, 0.0, 0.0)
    for k in range(PERIODS):
        for at, carriage, micro in ORDERS:
            if at == k:
                aim = twin.Aim(carriage, micro, own, 0.0)
        state, _, _ = step(*given, state, aim, k * PERIOD, PERIOD)
        if (k + 1) % EVERY == 0:
            rows.append((state.bench.macro.x, state.bench.micro.wire.x))
    return np.array(rows)


@pytest.mark.slow
@pytest.mark.parametrize("own", [0.0, 1.0])
def test_ten_seconds_are_those_of_python(twin: Any, window: Any, own: float) -> None:
    script = window.driver.execute_async_script
    found = np.array(script(STEPPED, own, ORDERS, PERIODS, EVERY))
    expected = simulated(twin, own)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-9)
    held = expected[: 6000 // EVERY]  # the first moves have arrived
    assert abs(held[-1, 0] - 840.0 * COUNT) < 4 * COUNT and abs(held[-1, 1] - 2e-3) < 2e-5


@pytest.mark.slow
def test_the_page_moves_and_follows_its_controls(window: Any) -> None:
    run, wait = window.run, window.driver.execute_async_script
    frames = """
    const done = arguments[0], start = machine.periods;
    setTimeout(() => done([start, machine.periods, machine.get("true.carriage")]), 3000);
    """
    before, after, carriage = wait(frames)
    assert after - before > 500 and carriage > 0.03
    assert run("return document.querySelectorAll('input[type=range]').length") >= 6
    run("""
    for (const [title, value] of [["Coulomb friction", 8], ["Backlash", 4], ["Carriage", 100]]) {
      const labels = [...document.querySelectorAll("label")];
      const input = labels.find(l => l.textContent.startsWith(title)).querySelector("input");
      input.value = value; input.oninput();
    }
    """)
    assert run("return machine.get('plant.macro.friction.coulomb')") == 8.0
    behind = run("machine.step(3000); return machine.get('true.carriage')")
    assert behind == pytest.approx(0.1 - 0.5 * 4e-3, abs=2 * COUNT)  # it was pushed from below
    corners = run("return machine.corners()")
    assert len(corners) >= 1 and all(math.isfinite(v) for row in corners for v in row)
    picture = "const c = document.getElementById('plane'); return new Set(c.getContext('2d')"
    assert run(f"{picture}.getImageData(0, 0, c.width, c.height).data).size") > 5
    wider, found = run(browser.WIDER)
    assert wider <= 0 and not found
    assert not [line for line in window.driver.get_log("browser") if line["level"] == "SEVERE"]
