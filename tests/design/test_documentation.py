"""docs/validation/reproduce.md: the example of every design sheet prints what the page says."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

from macromicro import design

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "validation" / "reproduce.md").read_text(encoding="utf-8")
EXAMPLE = re.search(
    r"## Design sheets\n.*?```python\n(.*?)```\n\n```text\n(.*?)```", PAGE, re.DOTALL
)


def test_the_example_uses_every_sheet_and_prints_what_the_page_says() -> None:
    assert EXAMPLE is not None
    code, printed = EXAMPLE.groups()
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, "docs/validation/reproduce.md", "exec"), {"__name__": "example"})
    assert out.getvalue() == printed
    used = set(re.findall(r"design\.(\w+)\(", code))
    modules = {design._HOMES[name] for name in used}
    assert modules == {"flexure_sheet", "resolution", "magnets", "hall_sensors", "costs"}
