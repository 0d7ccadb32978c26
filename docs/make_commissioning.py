"""Commissions random machines and writes what came of it into validation/machines.md.

    python docs/make_commissioning.py [KIND] [--number N] [--rows FILE]

Machines are drawn over wide ranges of data-sheet figures; what cannot work is drawn anew, by the
rules that a settings file meets, too. Each is commissioned as a person would do it, without a look
at its figures; then what was found is compared with them. KIND is axis, hanging, rotary, eccentric,
piezo, wire, xy, two_stage or examples; all of them without it, within some hours. FILE keeps what
came of each: what is there is not done again. `--quick` commissions one axis and writes nothing.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

import commissioning_axis
import commissioning_piezo
import commissioning_rotary
import commissioning_two_stage
import commissioning_wire
import commissioning_xy
from commissioning_table import cases, examples, table

PAGE = Path(__file__).resolve().parent / "validation" / "machines.md"
DRAWN = {
    "axis": commissioning_axis.DRAWN,
    "hanging": commissioning_axis.HANGING,
    "rotary": commissioning_rotary.DRAWN,
    "eccentric": commissioning_rotary.ECCENTRIC,
    "piezo": commissioning_piezo.DRAWN,
    "wire": commissioning_wire.DRAWN,
}
OTHERS = {"xy": commissioning_xy.cases, "two_stage": commissioning_two_stage.cases}
EXAMPLES = "examples"


def main(names: list[str], number: int | None, rows: Path | None) -> None:
    """Commission machines of some kinds and write their tables."""
    for name in names:
        text = _text(name, number, rows)
        print(text)
        marked = re.compile(rf"(<!-- measured: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        page = PAGE.read_text(encoding="utf-8")
        if not marked.search(page):
            raise SystemExit(f"{PAGE}: no table of {name}")
        # No template: the text may hold backslashes.
        parts = marked.split(page, maxsplit=1)
        PAGE.write_text(parts[0] + parts[1] + text + "".join(parts[2:]), encoding="utf-8")


def _text(name: str, number: int | None, rows: Path | None) -> str:
    if name == EXAMPLES:
        return examples()
    every = OTHERS[name](number) if name in OTHERS else cases(DRAWN[name], number)
    return table(every, rows)


if __name__ == "__main__":
    kinds = [*DRAWN, *OTHERS, EXAMPLES]
    words = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    words.add_argument("kind", nargs="?", choices=kinds)
    words.add_argument("--number", type=int)
    words.add_argument("--rows", type=Path)
    words.add_argument("--quick", action="store_true")
    asked = words.parse_args()
    if asked.rows is not None and asked.kind is None:
        words.error("--rows goes with one KIND: axes of several kinds have the same labels")
    if asked.quick:
        print(_text("axis", 1, None))
        sys.exit()
    main([asked.kind] if asked.kind else kinds, asked.number, asked.rows)
