"""docs/choose.md: every example runs, by itself, and prints what the page says."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

import pytest

from macromicro import design

PAGE = (Path(__file__).parents[2] / "docs" / "choose.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(
    r"## (.*?)\n(?:(?!\n## ).)*?```python\n(.*?)```\n\n```text\n(.*?)```", PAGE, re.S
)


@pytest.mark.parametrize(
    ("code", "printed"), [e[1:] for e in EXAMPLES], ids=[e[0] for e in EXAMPLES]
)
def test_example(code: str, printed: str) -> None:
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        exec(compile(code, "docs/choose.md", "exec"), {"__name__": "example"})
    assert out.getvalue() == printed


def test_no_example_is_missed_and_every_sheet_has_one() -> None:
    assert len(EXAMPLES) == PAGE.count("```python") == PAGE.count("```text") == 5
    used = set(re.findall(r"design\.(\w+)\(", PAGE))
    modules = {design._HOMES[name] for name in used}
    assert modules == {"flexure_sheet", "resolution", "magnets", "hall_sensors", "costs"}
