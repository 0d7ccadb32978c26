"""Commissions random machines and writes what came of it into docs/commissioning.md.

    python docs/make_commissioning.py [KIND] [NUMBER]

Machines are drawn over wide ranges of data-sheet figures; what cannot work is drawn anew, by the
rules that a settings file meets, too. Each is commissioned as a person would do it, without a look
at its figures; then what was found is compared with them. KIND is axis, hanging, rotary, piezo,
wire or examples; all of them without it, within two hours.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

import commissioning_axis
import commissioning_piezo
import commissioning_rotary
import commissioning_wire
from commissioning_table import examples, table

PAGE = Path(__file__).resolve().parent / "commissioning.md"
DRAWN = {
    "axis": commissioning_axis.DRAWN,
    "hanging": commissioning_axis.HANGING,
    "rotary": commissioning_rotary.DRAWN,
    "piezo": commissioning_piezo.DRAWN,
    "wire": commissioning_wire.DRAWN,
}
EXAMPLES = "examples"


def main(names: list[str], number: int | None) -> None:
    """Commission machines of some kinds and write their tables."""
    for name in names:
        text = examples() if name == EXAMPLES else table(DRAWN[name], number)
        print(text)
        marked = re.compile(rf"(<!-- measured: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        page = PAGE.read_text(encoding="utf-8")
        if not marked.search(page):
            raise SystemExit(f"{PAGE}: no table of {name}")
        PAGE.write_text(marked.sub(lambda m, t=text: m[1] + t + m[2], page), encoding="utf-8")


if __name__ == "__main__":
    main(
        sys.argv[1:2] or [*DRAWN, EXAMPLES],
        int(sys.argv[2]) if len(sys.argv) > 2 else None,
    )
