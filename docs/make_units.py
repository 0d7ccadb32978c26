"""Write src/macromicro/unit_sizes.json anew: what pint makes of every unit that the package's
own parameters use, so that a run need not import pint.

    python docs/make_units.py
"""

from __future__ import annotations

import json
from pathlib import Path

from macromicro import units
from macromicro.parameters import entries
from macromicro.plant.cycle import CycleBench
from macromicro.plant.kiln import KilnBench
from macromicro.serve.settings import LiveSettings

FILE = Path(units.__file__).parent / "unit_sizes.json"


def wanted() -> list[str]:
    """Every unit of the closed list, and every unit text of a parameter."""
    used = {
        text
        for tree in (LiveSettings(), KilnBench(), CycleBench())
        for e in entries(tree)
        for text in (e.par.unit, e.par.shown)
    }
    return sorted({*units._names(), "count", "bit", *used})


def table() -> dict[str, tuple[str, dict[str, float]]]:
    """Unit text: size in base units, and its dimension."""
    found = {}
    for text in wanted():
        size, dimension = units.by_pint(text)
        found[text] = (str(size), dict(dimension))
    return found


if __name__ == "__main__":
    lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(v)}" for k, v in table().items())
    FILE.write_text("{\n" + lines + "\n}\n", encoding="utf-8")
