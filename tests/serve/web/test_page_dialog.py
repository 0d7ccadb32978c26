"""Reviewing changes of settings: the stops stay in reach, and numbers are numbers."""

from __future__ import annotations

import time

import pytest
from page_parts import Page

from macromicro.control.live import messages as m
from tests.browser import DESK, PHONE
from tests.waiting import until

OPEN = "return document.querySelector('#diff').open"
SETTING = "input[aria-label='sequence.wait']"


def typed(page: Page, words: str, setting: str = SETTING) -> None:
    """Type into the field of a setting, and ask to review."""
    page.run("document.querySelector('#gains').open = true")
    field = page.find(setting)
    field.clear()
    field.send_keys(words)
    page.click("#review")


def value(page: Page) -> float:
    """The setting in force, as the page has it."""
    page.run("document.querySelector('#gains').open = true")
    page.click("#revert")
    return float(page.run(f'return document.querySelector("{SETTING}").value'))


def changes(page: Page) -> int:
    """How often settings were changed so far."""
    return sum(e.kind == "gains" for e in page.station.events()[1])


@pytest.mark.parametrize(
    ("how", "size"),
    [
        ("#stop", PHONE),
        ("#emergency", DESK),
        pytest.param("#stop", DESK, marks=pytest.mark.slow),
        pytest.param("#emergency", PHONE, marks=pytest.mark.slow),
        (" ", DESK),  # a key's way does not go by the size
        pytest.param("\ue00c", DESK, marks=pytest.mark.slow),
    ],
)
def test_both_stops_work_while_changes_are_reviewed(
    ready: Page, how: str, size: tuple[int, int]
) -> None:
    ready.shape(size)
    before = changes(ready)
    typed(ready, "1.5")
    assert ready.run(OPEN)
    # Ordered beside the page: a busy computer types more slowly than the carriage moves.
    now = ready.station.snapshot()
    order = m.MoveTo(0.15 if now.position_m < 0.075 else 0.005)
    reply = ready.station.request(now.holder, order)
    assert isinstance(reply, m.Accepted)
    motion = reply.id
    ready.moving()
    if how.startswith("#"):
        ready.find(how).click()  # fails where anything lies over it, or it is inert
    else:
        ready.keys(how)
    hard = how in ("#emergency", "\ue00c")
    assert ready.outcome(motion) == (m.EMERGENCY if hard else m.STOPPED_BY_REQUEST)
    assert ready.run(OPEN) != hard
    assert changes(ready) == before
    ready.shape(DESK)


@pytest.mark.slow
def test_the_focus_goes_into_the_dialog_and_back(ready: Page) -> None:
    typed(ready, "1.5")
    assert ready.run("return document.activeElement.id") == "diff"
    ready.keys("\ue007")  # an Enter that is still held down applies nothing
    assert ready.run(OPEN)
    ready.keys("\ue004")
    assert ready.run("return document.activeElement.id") == "apply"
    reach = set()
    for _ in range(8):
        ready.keys("\ue004")
        reach.add(ready.run("return document.activeElement.id"))
    assert {"stop", "emergency"} <= reach and not reach & {"take", "move-value", "review"}
    ready.click("#cancel")
    assert not ready.run(OPEN) and ready.run("return document.activeElement.id") == "review"
    assert ready.find("#take").is_displayed() and ready.run(
        "return !document.querySelector('main').inert"
    )


def test_the_dialog_lies_above_the_footer_and_within_the_screen(ready: Page) -> None:
    for size in (PHONE, DESK):
        ready.shape(size)
        typed(ready, "1.5")
        bottom, footer, left, right = ready.run(
            """const box = document.querySelector('#diff').getBoundingClientRect();
               return [box.bottom, document.querySelector('footer').getBoundingClientRect().top,
                       box.left, box.right];"""
        )
        assert bottom <= footer and 0 <= left < right <= size[0]
        ready.click("#cancel")


@pytest.mark.slow
def test_numbers_are_compared_as_numbers(ready: Page) -> None:
    now = value(ready)
    for same in (f"{now:.3f}", f"{now:.2f}".replace(".", ","), f" {now}", f"{now:e}"):
        typed(ready, same)
        assert not ready.run(OPEN) and "Nothing" in ready.text("#gains-problem")
        assert ready.run("return document.querySelectorAll('tr.changed').length") == 0
    for bad in ("0x10", "1_2", "1e", "Infinity", "--1", ""):
        typed(ready, bad)
        assert not ready.run(OPEN) and "give a number" in ready.text("#gains-problem")
    typed(ready, "1,5")
    assert ready.run(OPEN) and "1.5 s" in ready.text("#diff-rows")
    ready.click("#cancel")


@pytest.mark.slow
def test_a_change_back_is_taken_at_once(ready: Page) -> None:
    now = value(ready)
    for new in (now + 0.25, now):
        typed(ready, str(new))
        ready.click("#apply")
        ready.says("Settings: done")
        ready.run("document.querySelector('#status').textContent = ''")
        until(lambda: ready.run("return document.querySelectorAll('tr.changed').length") == 0)
    time.sleep(0.2)
    assert value(ready) == now
