"""The text of the site's pages, where it differs from that of the documents, and a look at what a
built page would fetch."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TWIN = "../twin.html"  # the machine as WebAssembly, which docs/make_twin.py makes
_SHOWN = f"""
<iframe src="{TWIN}" title="The two-stage machine" width="100%" height="1080"></iframe>

<p>The two-stage machine, simulated in your browser; <a href="{TWIN}">alone on a page</a>.</p>
"""
_SOURCE = re.compile(r"\[`?([\w.]+)`?\]\([./]*src/([\w/]+)\.py\)")
_PAGE = re.compile(r"\]\(([^)\s:#]+)\.(?:md|ipynb)\)")
_TAGS = re.compile(
    r"<(?:script|img|iframe|source|audio|video|embed|object|link)\b[^>]*?"
    r"\b(?:src|href|data)=[\"']?((?:https?:)?//[^\"'\s>]+)",
    re.IGNORECASE,
)
_STYLES = re.compile(r"(?:@import\s+|url\()\s*[\"']?((?:https?:)?//[^\"')\s]+)", re.IGNORECASE)


def linked(text: str) -> str:
    """A page whose links to source code are links to the reference."""
    return _SOURCE.sub(_role, text)


def _role(found: re.Match[str]) -> str:
    """A link to source code as one to the reference: "belt.step" in plant/belt.py."""
    label, module = found[1], found[2].replace("/", ".").removesuffix(".__init__")
    short, _, name = label.partition(".")
    if short != module.rpartition(".")[2] or not name:
        return f"{{py:mod}}`{label} <{module}>`"
    return f"{{py:obj}}`{label} <{module}.{name}>`"


def front(text: str) -> str:
    """The front page: with the simulated machine before the first section, and the contents."""
    head, section, rest = text.partition("\n## ")
    return f"{head}{_SHOWN}{section}{rest}{contents(text)}"


def contents(text: str) -> str:
    """Hidden tables of contents: the pages that each section of the front page links, but not those
    of which it links a part; then the reference."""
    sections = {}
    for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        title, _, body = part.partition("\n")
        sections[title.strip()] = list(dict.fromkeys(_PAGE.findall(body)))
    reference = sorted((ROOT / "docs" / "reference").glob("*.rst"))
    sections["Python"] = [f"reference/{page.stem}" for page in reference]
    return "".join(
        f"\n```{{toctree}}\n:hidden:\n:caption: {title}\n\n" + "\n".join(pages) + "\n```\n"
        for title, pages in sections.items()
    )


def fetched(site: Path) -> list[str]:
    """Each address that a page or style sheet of the site would load from, with its file."""
    found = []
    for place in sorted(site.rglob("*")):
        wanted = {".html": _TAGS, ".css": _STYLES}.get(place.suffix)
        if wanted is not None:
            text = place.read_text(encoding="utf-8")
            found += [f"{place.relative_to(site)}: {to}" for to in wanted.findall(text)]
    return found
