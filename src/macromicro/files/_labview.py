"""LabVIEW measurement files (.lvm): units and implicit times from the header."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from macromicro.arrays import Array
from macromicro.files.naming import BESIDE, spelled
from macromicro.files.table import Columns, Table

BEGIN = "LabVIEW Measurement"
_TIME = "X_Value"


def completed(table: Table, before: Sequence[str]) -> Table:
    """A text's table completed by its LabVIEW header, if any."""
    if not before or not before[0].startswith(BEGIN):
        return table
    said = {}
    for line in before:
        key, _, rest = line.partition("\t")
        said[key] = [cell.strip() for cell in rest.split("\t")]
    units, reasons = dict(table.units), dict(table.reasons)
    channels = [name for name in table.columns if name not in (_TIME, "Comment")]
    for name, unit in zip(channels, said.get("Y_Unit_Label", []), strict=False):
        if good := spelled(unit):
            units[name], reasons[name] = good, BESIDE
    first, step = (_first(said.get(key, [])) for key in ("X0", "Delta_X"))
    if _TIME in table.columns:
        units[_TIME], reasons[_TIME] = "s", "LabVIEW's"
    if said.get("X_Columns", [""])[0] != "No" or not step:
        return table._replace(units=units, reasons=reasons)
    inner = table.columns

    def fetch(names: Sequence[str]) -> dict[str, Array]:
        other = [name for name in names if name != _TIME] or channels[:1]
        found = table._replace(columns=inner).several(other)
        rows = len(next(iter(found.values())))
        return {**found, _TIME: (first or 0.0) + step * np.arange(rows, dtype=np.float64)}

    names = dict.fromkeys([_TIME, *inner])
    units[_TIME], reasons[_TIME] = "s", "first value and step in the header"
    return table._replace(columns=Columns(names, fetch), units=units, reasons=reasons)


def _first(words: Sequence[str]) -> float | None:
    try:
        return float(words[0].replace(",", "."))
    except (IndexError, ValueError):
        return None
