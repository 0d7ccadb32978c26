"""Draws docs/figures/wiring.svg: what is connected to which pin of the board, and to which supply.

Pins are those of `macromicro.rig.board`'s pins.toml; this script says which part each belongs to.

    python docs/make_wiring.py
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

from macromicro.drawing.files import SVG, encoded
from macromicro.drawing.style import BLACK, BLUE, GREEN, ORANGE, PURPLE, RED, new
from macromicro.rig.board import protocol

PICTURE = Path(__file__).resolve().parent / "figures" / "wiring.svg"
PINS = {name: pin for name, pin in protocol.table("pins").items() if isinstance(pin, dict)}
ROW = 0.46  # height of a wire
BOARD = (-1.15, 1.15)  # left and right edge
WAY = 1.9  # from the board to a part
BROAD = 2.6  # of a part
SUPPLY = {"5 V": RED, "GND": BLACK, "20 V": PURPLE, "4 V": ORANGE}
AGAINST = "10 kohm"  # to ground, at the pin: what holds an output off while the board is reset


class Part(NamedTuple):
    """A part, and its terminals from top to bottom: a pin of the board or a supply, and a label."""

    name: str
    terminals: tuple[tuple[str, str], ...]


LEFT = (
    Part("encoder", (("5 V", "5 V"), ("encoder_a", "A"), ("encoder_b", "B"), ("GND", "GND"))),
    Part("lower limit switch (NC)", (("limit_low", "1"), ("GND", "2"))),
    Part("upper limit switch (NC)", (("limit_high", "1"), ("GND", "2"))),
    Part("Hall sensor, with filter", (("5 V", "+"), ("hall", "output"), ("GND", "-"))),
)
RIGHT = (
    Part(
        "motor bridge, to the motor",
        (
            ("20 V", "VM, behind the stop"),
            ("enable", "enable"),
            ("motor_forward", "IN1"),
            ("motor_back", "IN2"),
            ("bridge_fault", "nFAULT"),
            ("GND", "GND"),
        ),
    ),
    Part(
        "driver of the wire",
        (
            ("4 V", "V, by a fuse"),
            ("wire", "input"),
            ("extend", "EXTEND"),
            ("contract", "CONTRACT"),
            ("GND", "GND"),
        ),
    ),
)


def main() -> None:
    """Draw it."""
    used = [t for part in (*LEFT, *RIGHT) for t, _ in part.terminals if t not in SUPPLY]
    assert sorted(used) == sorted(PINS), "a pin without a part, or twice"
    figure, axes = new(5.6, 1)
    ax = axes[0, 0]
    figure.subplots_adjust(left=0.01, right=0.99, top=0.99, bottom=0.01)
    ax.set_axis_off()
    bottom = min(_side(ax, LEFT, -1.0), _side(ax, RIGHT, 1.0))
    box(ax, BOARD[0], bottom - 0.2, BOARD[1] - BOARD[0], -bottom + 0.3, "#eef3f7")
    words = f"{protocol.table('pins')['board']}\nArduino Uno\nor Nano\n\nUSB to the host"
    ax.text(0.0, bottom / 2.0, words, ha="center", va="center", fontsize=9)
    ax.text(
        0.0, bottom - 0.75,
        f"One ground for all. R: {AGAINST} to ground at the pin. NC: opens when it is tripped. "
        "Filter: 1 kohm in the line, 100 nF from A0 to ground.",
        ha="center", fontsize=8,
    )  # fmt: skip
    ax.set_xlim(-5.8, 5.8)
    ax.set_ylim(bottom - 1.0, 0.5)
    PICTURE.write_bytes(encoded(figure, SVG))
    print(PICTURE)


def _side(ax: Any, parts: tuple[Part, ...], side: float) -> float:
    """The parts on one side of the board; where the last ends."""
    y = -0.35
    for part in parts:
        high = ROW * (len(part.terminals) + 0.9)
        x = side * (BOARD[1] + WAY)
        box(ax, min(x, x + side * BROAD), y - high + ROW * 0.5, BROAD, high, "#fbf6ec")
        ax.text(x + side * BROAD / 2.0, y + ROW * 0.05, part.name, ha="center", va="center",
                fontsize=8.5, weight="bold")  # fmt: skip
        for k, (end, label) in enumerate(part.terminals, 1):
            _wire(ax, y - k * ROW, side, end, label)
        y -= high + 0.25
    return y


def _wire(ax: Any, y: float, side: float, end: str, label: str) -> None:
    """From a pin, or from a supply, to a terminal."""
    near, far = side * BOARD[1], side * (BOARD[1] + WAY)
    inward = "left" if side > 0.0 else "right"
    ax.text(far + side * 0.08, y, label, ha=inward, va="center", fontsize=8)
    if end in SUPPLY:
        start = far - side * 0.55
        ax.plot([start, far], [y, y], color=SUPPLY[end], linewidth=1.6)
        ax.plot([start], [y], "o", color=SUPPLY[end], markersize=4)
        ax.text(start - side * 0.1, y, end, ha="right" if side > 0.0 else "left", va="center",
                fontsize=8, color=SUPPLY[end])  # fmt: skip
        return
    pin = PINS[end]
    color = BLUE if pin["way"] == "out" else GREEN
    ax.annotate("", (far, y) if pin["way"] == "out" else (near, y),
                (near, y) if pin["way"] == "out" else (far, y),
                arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.2,
                            "shrinkA": 0, "shrinkB": 0})  # fmt: skip
    ax.text(near - side * 0.08, y, pin["pin"], ha="right" if side > 0.0 else "left", va="center",
            fontsize=8, weight="bold")  # fmt: skip
    if AGAINST in pin["to"]:
        ax.text(near + side * 0.22, y + 0.07, "R", ha="center", fontsize=7, color=BLACK)


def box(ax: Any, x: float, y: float, wide: float, high: float, color: str) -> None:
    """A rectangle."""
    from matplotlib.patches import Rectangle

    ax.add_patch(Rectangle((x, y), wide, high, facecolor=color, edgecolor="0.3", linewidth=1.0))


if __name__ == "__main__":
    main()
