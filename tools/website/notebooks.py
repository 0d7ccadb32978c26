"""Notebooks: scripts in the percent format, executed and kept with their outputs.

    PYTHONPATH=tools python -m website.notebooks [NAME ...]

Each script of notebooks/ has a notebook of the same name beside it, which this writes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import jupytext

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "notebooks"
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def scripts() -> list[Path]:
    """The scripts, by name."""
    return sorted(FOLDER.glob("*.py"))


def executed(script: Path) -> Any:
    """A script as a notebook with its outputs."""
    from nbclient import NotebookClient

    made = jupytext.read(script)
    for k, cell in enumerate(made.cells):
        cell.id, cell.metadata = f"cell-{k}", {}
    place = {"metadata": {"path": str(FOLDER)}}
    client = NotebookClient(
        made, timeout=120, record_timing=False, coalesce_streams=True, resources=place
    )
    client.execute()
    made.metadata = {"kernelspec": KERNEL}
    return made


def main(names: list[str]) -> None:
    """Execute the notebooks that are named, or all."""
    for script in scripts():
        if not names or script.stem in names:
            notebook = script.with_suffix(".ipynb")
            jupytext.write(executed(script), notebook)
            print(notebook.relative_to(ROOT))


if __name__ == "__main__":
    main(sys.argv[1:])
