"""Runs the commands of docs/examples.md and keeps their pictures: of `results/NAME` in
docs/figures/examples/NAME. Renews the table of machine files.

python docs/make_examples.py [--quick: the first example, nothing is written]
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import measured_page

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "examples.md"
PICTURES = ROOT / "docs" / "figures" / "examples"
EXAMPLE = re.compile(r"^## \d+\. .*?(?=^## )", re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r"^    macromicro (.+)$", re.MULTILINE)
PICTURE = re.compile(r"\(figures/examples/(\S+)\)")


def machines() -> str:
    """The machine files by their first line."""
    rows = "".join(
        f"| [`{path.name}`](../examples/machines/{path.name}) | {_first(path)} |\n"
        for path in sorted((ROOT / "examples" / "machines").glob("*.toml"))
    )
    return f"| file | machine |\n|---|---|\n{rows}"


def _first(path: Path) -> str:
    return path.read_text(encoding="utf-8").partition("\n")[0].lstrip("# ")


def run(example: str, folder: Path) -> dict[str, Path]:
    """Run an example's commands in a folder; the pictures that the page shows, by their names."""
    for command in COMMAND.findall(example):
        words = [sys.executable, "-m", "macromicro", *shlex.split(command)]
        subprocess.run(words, cwd=folder, check=True, capture_output=True)
    return {name: folder / "results" / name for name in PICTURE.findall(example)}


def main() -> None:
    """Run every example, keep its pictures and renew the table."""
    examples = EXAMPLE.findall(PAGE.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "examples", folder / "examples")
        if "--quick" in sys.argv:
            assert all(picture.is_file() for picture in run(examples[0], folder).values())
            return
        for example in examples:
            for shown, picture in run(example, folder).items():
                (PICTURES / shown).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(picture, PICTURES / shown)
    measured_page.put(PAGE, "machine files", machines())


if __name__ == "__main__":
    main()
