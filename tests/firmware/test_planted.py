"""Mistakes planted in the firmware one at a time: the trial's judge must see each of them."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.firmware.built import ROOT, generated, needs_avr

pytestmark = [needs_avr, pytest.mark.slow, pytest.mark.timeout(1200)]

PERIODS = 240_000  # of the board, at most; most mistakes are seen within seconds
_BEHIND = (
    ("static uint16_t quiet;", "static uint16_t quiet, was;"),
    ("        quiet = 0;\n", "        was = quiet;\n        quiet = 0;\n"),
)
_COLD = "\n        // ctrl = 0.0\n        ctrl = 0.0f;"  # in silence
# What is wrong: the file, what stands there and what instead, the injury that shows it.
MISTAKES = {
    "falls after 0.6 s of silence": (
        "two_stage_board.c",
        [("order->quiet > CONTROL_SILENCE)", "order->quiet > 0.6f)")],
        "silence",
    ),
    "falls too slowly": (
        "two_stage_board.c",
        [("(1.0f - dt / left)", "(1.0f - 0.25f * dt / left)")],
        "silence",
    ),
    "falls too soon": (
        "two_stage_board.c",
        [("order->quiet > CONTROL_SILENCE)", "order->quiet > 0.35f)")],
        "silence",
    ),
    "goes on behind 0.7 s of silence": (
        "two_stage_board.c",
        [
            ("order->quiet >= CONTROL_SILENCE + CONTROL_DECELERATE", "order->quiet > 9.0f"),
            (f": 0.0f;{_COLD}", f": 0.1f;{_COLD}"),
        ],
        "silence",
    ),
    "the wire is on in silence": (
        "two_stage_board.c",
        [(f": 0.0f;{_COLD}", ": 0.0f;")],
        "silence",
    ),
    "the first order behind a silence is turned round": (
        "core.c",
        [*_BEHIND, ("asked.motor = it.motor;", "asked.motor = was > 495 ? -it.motor : it.motor;")],
        "silence",
    ),
    "the first order behind near silence is too large": (
        "core.c",
        [
            *_BEHIND,
            ("asked.motor = it.motor;", "asked.motor = (was > 395 ? 1.05f : 1.0f) * it.motor;"),
        ],
        "silence",
    ),
    "a little too large": (
        "core.c",
        [("asked.motor = it.motor;", "asked.motor = 1.02f * it.motor;")],
        "halt",
    ),
    "the wire a little too hot": (
        "core.c",
        [("asked.ctrl = it.ctrl;", "asked.ctrl = 1.05f * it.ctrl;")],
        "halt",
    ),
    "a wrong CRC is obeyed": (
        "link.c",
        [
            (
                "length < 4 || in->bytes[length - 2] != (uint8_t)crc\n"
                "            || in->bytes[length - 1] != (uint8_t)(crc >> 8)",
                "length < 4",
            )
        ],
        "flips",
    ),
    "a stop is not obeyed": (
        "core.c",
        [("        safe();\n        done(FRAME_STOP", "        done(FRAME_STOP")],
        "halt",
    ),
    "it is late without a flood": (
        "core.c",
        [("    if (!late) {", "    if (now % 5000 != 0 && !late) {")],
        "halt",
    ),
}  # fmt: skip


def _built(name: str, folder: Path) -> Path:
    """The firmware with this mistake."""
    shutil.copytree(ROOT / "firmware", folder / "firmware")
    shutil.copytree(generated(), folder / "out", ignore=shutil.ignore_patterns("*.elf", "*.hex"))
    file, changes, _ = MISTAKES[name]
    place = next(found for found in folder.rglob(file))
    text = place.read_text("utf-8")
    for old, new in changes:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    place.write_text(text, "utf-8")
    made = subprocess.run(
        ["make", "-C", str(folder / "firmware"), f"OUT={folder / 'out'}", "atmega328p"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    return folder / "out" / "atmega328p.elf"


@pytest.mark.parametrize("name", MISTAKES)
def test_a_planted_mistake_is_seen(name: str, tmp_path: Path) -> None:
    from boardtrial import orders
    from boardtrial.trial import Trial

    trial = Trial(_built(name, tmp_path), 3)
    injury = getattr(orders, MISTAKES[name][2])
    while trial.line.bench.tick < PERIODS:
        trial.round(orders.ORDERS, (injury,))
        if trial.judge.count or trial.count:
            return
    raise AssertionError(f"nothing was seen in {PERIODS} periods")
