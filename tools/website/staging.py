"""The pages as Sphinx gets them: in one folder, with the site's names in their links."""

from __future__ import annotations

import json
import os
import re
import shutil
from pathlib import Path

from website import notebooks, pages, reference
from website.pages import BESIDE, INDEX, ROOT

TWIN = "twin.html"  # the machine as WebAssembly, which docs/make_twin.py makes beside the pages
FILES = "files"  # the folder of files that pages link and that are no pages
_TARGET = re.compile(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_FENCED = re.compile(r"(^```.*?^```$)", re.DOTALL | re.MULTILINE)


def staged(name: str) -> str:
    """Where a file of the repository lies on the site."""
    if name in BESIDE:
        return BESIDE[name]
    if name.endswith(".ipynb"):
        return str(Path(name).with_suffix(".md"))
    inside = name.removeprefix("docs/")
    return inside if inside != name else f"{FILES}/{name}"


def _role(text: str, name: str) -> str:
    """A link to source code as one to the reference: "`belt.step`" in plant/belt.py."""
    module, label = reference.module(name), text.strip("`")
    short = module.rpartition(".")[2]
    if not label.startswith(f"{short}."):
        return f"{{py:mod}}`{label} <{module}>`"
    home = f"{module}.{label.removeprefix(f'{short}.')}"
    return f"{{py:obj}}`{label} <{reference.documented()[home].name}>`"


def rewritten(page: str, text: str, into: Path) -> str:
    """A page's text with the site's names in its links; files that it links are copied."""
    here = Path(staged(page)).parent

    def link(found: re.Match[str]) -> str:
        text, target = found[1], found[2]
        if "://" in target or target.startswith("#") or (into / here / target).is_file():
            return found[0]
        name, anchor = pages.linked(page, target)
        if name.startswith("src/") and name.endswith(".py"):
            return _role(text, name)
        place = ROOT / name
        if place.is_dir():
            return text
        to = staged(name)
        if to.startswith(f"{FILES}/"):
            (into / to).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(place, into / to)
        tail = f"#{anchor}" if anchor else ""
        return f"[{text}]({os.path.relpath(to, here)}{tail})"

    parts = _FENCED.split(text.replace("\n```csv\n", "\n```text\n"))
    return "".join(part if k % 2 else _TARGET.sub(link, part) for k, part in enumerate(parts))


def contents() -> str:
    """Hidden tables of contents for the front page: a section each, then the reference."""
    text = ""
    for section in pages.navigation():
        listed = "\n".join(f"/{staged(name).removesuffix('.md')}" for name in section.pages)
        text += f"\n```{{toctree}}\n:hidden:\n:caption: {section.title}\n\n{listed}\n```\n"
    names = "\n".join(f"/reference/{page.name}" for page in reference.PAGES)
    return f"{text}\n```{{toctree}}\n:hidden:\n:caption: Python\n\n{names}\n```\n"


def front(text: str) -> str:
    """The front page: with the simulated machine before the first section, and the contents."""
    head, section, rest = text.partition("\n## ")
    shown = f"""
<iframe src="{TWIN}" title="The two-stage machine" width="100%" height="1080"></iframe>

<p>The two-stage machine, simulated in your browser; <a href="{TWIN}">alone on a page</a>.</p>
"""
    return f"{head}{shown}{section}{rest}{contents()}"


def stage(into: Path) -> None:
    """Write everything that Sphinx reads into a folder, which is emptied first."""
    shutil.rmtree(into, ignore_errors=True)
    into.mkdir(parents=True)
    shutil.copytree(ROOT / "docs" / "figures", into / "figures")
    for name in pages.names():
        place = into / staged(name)
        place.parent.mkdir(parents=True, exist_ok=True)
        text = (ROOT / name).read_text(encoding="utf-8")
        if name.endswith(".ipynb"):
            text = notebooks.page(place.stem, json.loads(text), place.parent)
        text = rewritten(name, text, into)
        place.write_text(front(text) if name == INDEX else text, encoding="utf-8")
    reference.write(into / "reference")
