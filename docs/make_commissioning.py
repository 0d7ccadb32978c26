"""Commissions random machines and writes what came of it into docs/commissioning.md.

    python docs/make_commissioning.py [KIND] [NUMBER]

Machines are drawn over wide ranges of data-sheet figures; what cannot work is drawn anew, by the
rules that a settings file meets, too. Each is commissioned as a person would do it, without a look
at its figures; then what was found is compared with them. KIND is axis, hanging, rotary, eccentric,
piezo, wire, xy, two_stage or examples; all of them without it, within some hours.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import commissioning_axis
import commissioning_piezo
import commissioning_rotary
import commissioning_two_stage
import commissioning_wire
import commissioning_xy
from commissioning_table import examples, shown, table

PAGE = Path(__file__).resolve().parent / "commissioning.md"
DRAWN = {
    "axis": commissioning_axis.DRAWN,
    "hanging": commissioning_axis.HANGING,
    "rotary": commissioning_rotary.DRAWN,
    "eccentric": commissioning_rotary.ECCENTRIC,
    "piezo": commissioning_piezo.DRAWN,
    "wire": commissioning_wire.DRAWN,
}
OTHERS = {"xy": commissioning_xy.tried, "two_stage": commissioning_two_stage.tried}
EXAMPLES = "examples"


def main(names: list[str], number: int | None) -> None:
    """Commission machines of some kinds and write their tables."""
    for name in names:
        text = _text(name, number)
        print(text)
        marked = re.compile(rf"(<!-- measured: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        page = PAGE.read_text(encoding="utf-8")
        if not marked.search(page):
            raise SystemExit(f"{PAGE}: no table of {name}")
        PAGE.write_text(marked.sub(lambda m, t=text: m[1] + t + m[2], page), encoding="utf-8")


def _text(name: str, number: int | None) -> str:
    if name == EXAMPLES:
        return examples()
    return shown(OTHERS[name](number)) if name in OTHERS else table(DRAWN[name], number)


if __name__ == "__main__":
    main(
        sys.argv[1:2] or [*DRAWN, *OTHERS, EXAMPLES],
        int(sys.argv[2]) if len(sys.argv) > 2 else None,
    )
