"""Which kernels of the package are exported, with which unit, and why others are not."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import NamedTuple

from macromicro.errors import InputError
from macromicro.export import catalogue, files
from macromicro.kernel import marked


class Row(NamedTuple):
    name: str  # module below the package, and function
    # what brings it along; ("module:kernel",) for one that is exported by its own name
    units: tuple[str, ...]
    reason: str  # why it cannot be exported; "" if it can


def rows() -> list[Row]:
    package = Path(__file__).parents[1]
    for file in sorted(package.rglob("*.py")):
        if re.search(r"^\s*@kernel$", file.read_text("utf-8"), re.MULTILINE):
            parts = file.relative_to(package.parent).with_suffix("").parts
            importlib.import_module(".".join(part for part in parts if part != "__init__"))
    brought: dict[object, list[str]] = {}
    for name, make in catalogue.every().items():
        for made in files.written(make()).routines:
            known = brought.setdefault(made.source.function, [])
            if name not in known:
                known.append(name)
    found = []
    for function in marked():
        if not function.__module__.startswith("macromicro."):
            continue
        short = function.__module__.removeprefix("macromicro.")
        name = f"{short}:{function.__qualname__.replace('.<locals>.', '.')}"
        if function in brought:
            found.append(Row(name, tuple(brought[function]), ""))
            continue
        try:
            files.written(catalogue.alone(function.__name__, function))
        except InputError as error:
            shown = error.value if isinstance(error.value, str) else repr(error.value)
            where = error.where.rpartition(", ")[2]
            found.append(Row(name, (), f"{where}: {shown}"))
        else:
            found.append(Row(name, (f"macromicro.{name}",), ""))
    return sorted(found)


def table() -> str:
    """The kernels as Markdown tables: the unit that exports them, and the omitted ones."""
    all_rows = rows()
    can = [row for row in all_rows if not row.reason]
    cannot = [row for row in all_rows if row.reason]
    by_module: dict[str, list[Row]] = {}
    for row in can:
        by_module.setdefault(row.name.partition(":")[0], []).append(row)
    lines = [
        f"{len(can)} of {len(all_rows)} kernels are exported.",
        "",
        "| module | kernels | with |",
        "|---|---|---|",
    ]
    for module, members in by_module.items():
        names = ", ".join(f"`{row.name.partition(':')[2]}`" for row in members)
        units = sorted({unit for row in members for unit in row.units if ":" not in unit})
        own = any(":" in unit for row in members for unit in row.units)
        shown = [f"`{unit}`" for unit in units[:4]] + (["..."] if len(units) > 4 else [])
        shown += [f"its own name, `macromicro.{module}:KERNEL`"] if own else []
        lines.append(f"| `{module}` | {names} | {', '.join(shown)} |")
    lines += ["", "Not exported:", "", "| kernel | why |", "|---|---|"]
    lines += [f"| `{row.name}` | {row.reason} |" for row in cannot]
    return "\n".join(lines)
