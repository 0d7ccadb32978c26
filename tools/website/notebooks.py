"""Notebooks: scripts in the percent format, executed and kept with their outputs.

    PYTHONPATH=tools python -m website.notebooks [NAME ...]

Each script of notebooks/ has a notebook of the same name beside it, which this writes.
"""

from __future__ import annotations

import argparse
import base64
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from website.pages import ROOT

FOLDER = ROOT / "notebooks"
_CELL = re.compile(r"^# %%( \[markdown\])?\n", re.MULTILINE)
_SIZE = "import matplotlib; matplotlib.rcParams.update({'figure.dpi': 80, 'svg.hashsalt': 'x'})"


def scripts() -> list[Path]:
    """The scripts, by name."""
    return sorted(FOLDER.glob("*.py"))


def cells(text: str) -> Iterator[tuple[str, str]]:
    """The cells of a script: "markdown" or "code", and the text without its comment marks."""
    parts = _CELL.split(text)[1:]
    for mark, body in zip(parts[::2], parts[1::2], strict=True):
        if mark:
            yield "markdown", re.sub(r"^# ?", "", body.strip("\n"), flags=re.MULTILINE)
        else:
            yield "code", body.strip("\n")


def executed(script: Path) -> Any:
    """A script as a notebook with its outputs."""
    import nbformat
    from nbclient import NotebookClient

    made: Any = nbformat.v4.new_notebook()  # type: ignore[no-untyped-call]
    for k, (kind, text) in enumerate(cells(script.read_text(encoding="utf-8"))):
        new = nbformat.v4.new_markdown_cell if kind == "markdown" else nbformat.v4.new_code_cell
        made.cells.append(new(text, id=f"cell-{k}"))  # type: ignore[no-untyped-call]
    client = NotebookClient(
        made, timeout=120, record_timing=False, resources={"metadata": {"path": str(FOLDER)}}
    )
    with client.setup_kernel():
        assert client.kc is not None
        client.kc.execute(_SIZE)
        for k, cell in enumerate(made.cells):
            client.execute_cell(cell, k, execution_count=None)
    for cell in made.cells:
        cell.metadata.clear()
        if cell.cell_type == "code":
            cell.outputs = list(joined(cell.outputs))
        for output in cell.get("outputs", ()):
            output.get("metadata", {}).clear()
    made.metadata.clear()
    made.metadata["kernelspec"] = {
        "display_name": "Python 3",
        "language": "python",
        "name": "python3",
    }
    return made


def joined(outputs: list[Any]) -> Iterator[Any]:
    """Outputs, what one stream printed in several pieces as one."""
    last: Any = None
    for output in outputs:
        if last and output.output_type == "stream" and last.get("name") == output.name:
            last["text"] += output.text
            continue
        last = output
        yield output


def text(notebook: dict[str, Any]) -> list[str]:
    """What the cells of a notebook print, in their order; figures as their type."""
    found = []
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):
            data = output.get("data", {})
            if "image/png" in data:
                found.append("image/png")
            else:
                said = output.get("text", data.get("text/plain", output.get("ename", "")))
                found.append(said if isinstance(said, str) else "".join(said))
    return found


def page(name: str, notebook: dict[str, Any], into: Path) -> str:
    """A notebook as a page of the site; its pictures are written beside it."""
    lines = []
    for k, cell in enumerate(notebook["cells"]):
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            lines += [source, ""]
            continue
        lines += ["```python", source, "```", ""]
        for j, output in enumerate(cell["outputs"]):
            data = output.get("data", {})
            if "image/png" in data:
                picture = f"{name}-{k}-{j}.png"
                into.mkdir(parents=True, exist_ok=True)
                (into / picture).write_bytes(base64.b64decode("".join(data["image/png"])))
                lines += [f"![What the cell above draws]({picture})", ""]
            else:
                said = "".join(output.get("text", data.get("text/plain", ())))
                lines += ["```text", said.rstrip("\n"), "```", ""]
    lines += [
        "---",
        "",
        f"This page is `notebooks/{name}.ipynb`, its script `notebooks/{name}.py`.",
        "",
    ]
    return "\n".join(lines)


def main() -> None:
    """Execute the notebooks that are named, or all."""
    import nbformat

    parser = argparse.ArgumentParser(prog="python -m website.notebooks", description=__doc__)
    parser.add_argument("names", nargs="*", help="of scripts, without their ending")
    names = parser.parse_args().names
    for script in scripts():
        if not names or script.stem in names:
            nbformat.write(executed(script), script.with_suffix(".ipynb"))  # type: ignore[no-untyped-call]
            print(script.with_suffix(".ipynb").relative_to(ROOT))


if __name__ == "__main__":
    main()
