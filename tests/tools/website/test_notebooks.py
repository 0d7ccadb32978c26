"""Notebooks have the cells of their scripts, and show what these give when they are run now."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jupytext
import pytest

from website import notebooks

SCRIPTS = notebooks.scripts()
LIVE = "live-machine"  # a real machine's places and answers are not the same twice


def kept(script: Path) -> dict:
    """The notebook beside a script."""
    return json.loads(script.with_suffix(".ipynb").read_text(encoding="utf-8"))


def said(notebook: dict[str, Any]) -> list[str]:
    """What the cells of a notebook print, in their order; figures as their type."""
    found = []
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                found.append("image/png")
            else:
                text = output.get("text", data.get("text/plain", output.get("ename", "")))
                found.append(text if isinstance(text, str) else "".join(text))
    return found


def test_there_are_five() -> None:
    assert len(SCRIPTS) == 5
    assert len(list(notebooks.FOLDER.glob("*.ipynb"))) == 5


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_notebook_has_the_cells_of_its_script(script: Path) -> None:
    """With outputs that are small, no errors, and no paths of the computer that made them."""
    found = [(c["cell_type"], "".join(c["source"])) for c in kept(script)["cells"]]
    assert found == [(cell.cell_type, cell.source) for cell in jupytext.read(script).cells]
    outputs = [o for c in kept(script)["cells"] for o in c.get("outputs", ())]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not any(o["output_type"] == "error" or o.get("name") == "stderr" for o in outputs)
    text = script.with_suffix(".ipynb").read_text(encoding="utf-8")
    assert len(text) < 200_000 and "/site-packages/" not in text and "/src/macromicro" not in text


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_notebook_shows_what_its_script_gives_now(script: Path) -> None:
    """An error ends the run; what is printed is the same, figures are where they were."""
    now, before = said(notebooks.executed(script)), said(kept(script))
    if script.stem == LIVE:
        assert [text.partition(" at ")[0] for text in now] == [
            text.partition(" at ")[0] for text in before
        ]
    else:
        assert now == before
