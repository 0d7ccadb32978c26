"""Notebooks have the cells of their scripts, and show what these give when they are run now."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from website import notebooks

SCRIPTS = notebooks.scripts()
LIVE = "live-machine"  # a real machine's places and answers are not the same twice


def kept(script: Path) -> dict:
    """The notebook beside a script."""
    return json.loads(script.with_suffix(".ipynb").read_text(encoding="utf-8"))


def test_there_are_five() -> None:
    assert len(SCRIPTS) == 5
    assert len(list(notebooks.FOLDER.glob("*.ipynb"))) == 5


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_notebook_has_the_cells_of_its_script(script: Path) -> None:
    """With outputs that are small, no errors, and no paths of the computer that made them."""
    found = [(c["cell_type"], "".join(c["source"])) for c in kept(script)["cells"]]
    assert found == list(notebooks.cells(script.read_text(encoding="utf-8")))
    outputs = [o for c in kept(script)["cells"] for o in c.get("outputs", ())]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not any(o["output_type"] == "error" or o.get("name") == "stderr" for o in outputs)
    text = script.with_suffix(".ipynb").read_text(encoding="utf-8")
    assert len(text) < 200_000 and "/site-packages/" not in text and "/src/macromicro" not in text


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_notebook_shows_what_its_script_gives_now(script: Path) -> None:
    """An error ends the run; what is printed is the same, figures are where they were."""
    now, before = notebooks.text(notebooks.executed(script)), notebooks.text(kept(script))
    if script.stem == LIVE:
        assert [said.partition(" at ")[0] for said in now] == [
            said.partition(" at ")[0] for said in before
        ]
    else:
        assert now == before


def test_a_page_has_code_outputs_and_pictures(tmp_path: Path) -> None:
    picture = {"output_type": "display_data", "data": {"image/png": "aGFsbG8="}}
    said = {"output_type": "stream", "name": "stdout", "text": ["3\n"]}
    code = {"cell_type": "code", "source": ["print(3)"], "outputs": [said, picture]}
    cells = [{"cell_type": "markdown", "source": ["# Title"]}, code]
    text = notebooks.page("it", {"cells": cells}, tmp_path)
    assert "# Title\n\n```python\nprint(3)\n```\n\n```text\n3\n```\n" in text
    assert "](it-1-1.png)" in text and (tmp_path / "it-1-1.png").read_bytes() == b"hallo"


def test_cells_are_parted_by_their_marks() -> None:
    text = "# %% [markdown]\n# # A\n#\n# b\n\n# %%\nx = 1  # c\nx\n"
    assert list(notebooks.cells(text)) == [("markdown", "# A\n\nb"), ("code", "x = 1  # c\nx")]
