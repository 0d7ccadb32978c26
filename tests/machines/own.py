"""The machine of docs/own-machines.md, as a module outside the package."""

from __future__ import annotations

import importlib
import re
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

PAGE = Path(__file__).parents[2] / "docs" / "own-machines.md"
TEXT = PAGE.read_text("utf-8")
SOURCE = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)[0]
SETTINGS, TABLE = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)


@cache
def module() -> Any:
    """The page's module, imported as `ownlab`."""
    return _imported("ownlab", {"ownlab.py": SOURCE, "flexure.toml": TABLE})


def _imported(name: str, files: dict[str, str]) -> Any:
    place = Path(tempfile.mkdtemp())
    for file, text in files.items():
        (place / file).write_text(text, encoding="utf-8")
    sys.path.insert(0, str(place))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(place))
