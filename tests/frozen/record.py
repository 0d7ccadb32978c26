"""What results were when they were last agreed on, so that a change of any of them is seen.

A frozen value is no claim that it is right; tests of laws and facts stand beside the sources.
It says that nothing was changed without being meant: after a change that is meant, run

    MACROMICRO_FREEZE=1 .venv/bin/python -m pytest tests/frozen

look at the difference of the .json files, and say in the commit why they changed.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import re
from pathlib import Path
from typing import Any

import numpy as np

FOLDER = Path(__file__).parent
_NUMBER = re.compile(r"(?<![\w.])([-+]?\d+\.\d+(?:e[-+]?\d+)?)(?![\w.])")
_WHOLE = 40  # longer arrays are summed up


def plain(value: Any) -> Any:
    """A result as JSON: fields by name, long arrays by a few sums that every element enters."""
    if hasattr(value, "_asdict"):
        return {name: plain(item) for name, item in value._asdict().items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        fields = dataclasses.fields(value)
        return {f.name: plain(getattr(value, f.name)) for f in fields}
    if isinstance(value, dict):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return _array(value) if isinstance(value, np.ndarray) else _single(value)


def _single(value: Any) -> Any:
    value = value.item() if isinstance(value, np.generic) else value
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    known = value is None or isinstance(value, bool | int | float | str)
    return value if known else type(value).__name__


def _array(values: np.ndarray) -> Any:
    if values.size <= _WHOLE:
        return plain(values.tolist())
    flat = values.astype(float).ravel()
    good = np.where(np.isfinite(flat), flat, 0.0)
    weights = np.cos(0.7 + np.arange(flat.size))  # order and place of each element matter
    return {
        "shape": list(values.shape),
        "finite": int(np.isfinite(flat).sum()),
        "sum": float(good.sum()),
        "squares": float((good * good).sum()),
        "weighted": float((good * weights).sum()),
        "scale": float(np.abs(good).sum()),
    }


def frozen(name: str, value: Any, rel: float = 1e-6, absolute: float = 1e-12) -> None:
    """`value` is what it was under `name`, numbers to `rel` or `absolute`."""
    path = FOLDER / f"{name}.json"
    found = json.loads(json.dumps(plain(value)))
    if os.environ.get("MACROMICRO_FREEZE"):
        path.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n", encoding="utf-8")
        return
    agreed = json.loads(path.read_text(encoding="utf-8"))
    differences = list(_differences(agreed, found, rel, absolute, ""))
    shown = "\n".join(differences[:20])
    assert not differences, f"{name}: {len(differences)} values are not what they were:\n{shown}"


def _differences(old: Any, new: Any, rel: float, absolute: float, where: str) -> Any:
    if isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        slack = absolute
        if "scale" in old:  # sums that cancel are as exact as what they are sums of
            slack = max(absolute, rel * old["scale"])
        for key in old:
            yield from _differences(old[key], new[key], rel, slack, f"{where}.{key}")
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for k, (a, b) in enumerate(zip(old, new, strict=True)):
            yield from _differences(a, b, rel, absolute, f"{where}[{k}]")
    elif _numbers(old, new):
        if not math.isclose(old, new, rel_tol=rel, abs_tol=absolute):
            yield f"{where or 'value'}: {old!r} became {new!r}"
    elif isinstance(old, str) and isinstance(new, str):
        yield from _worded(old, new, rel, absolute, where)
    elif old != new:
        yield f"{where or 'value'}: {old!r:.80} became {new!r:.80}"


def _worded(old: str, new: str, rel: float, absolute: float, where: str) -> Any:
    """Texts whose words are the same and whose numbers are as near as other numbers."""
    parts, found = (_NUMBER.split(text) for text in (old, new))
    alike = parts[::2] == found[::2] and all(
        math.isclose(float(a), float(b), rel_tol=rel, abs_tol=absolute)
        for a, b in zip(parts[1::2], found[1::2], strict=True)
    )
    if not alike:
        yield f"{where or 'value'}: {old!r:.80} became {new!r:.80}"


def _numbers(*values: Any) -> bool:
    return all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
