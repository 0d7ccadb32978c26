"""Whether a built page would fetch anything from elsewhere."""

from __future__ import annotations

import re
from pathlib import Path

_TAGS = re.compile(
    r"<(?:script|img|iframe|source|audio|video|embed|object|link)\b[^>]*?"
    r"\b(?:src|href|data)=[\"']?((?:https?:)?//[^\"'\s>]+)",
    re.IGNORECASE,
)
_STYLES = re.compile(r"(?:@import\s+|url\()\s*[\"']?((?:https?:)?//[^\"')\s]+)", re.IGNORECASE)


def fetched(site: Path) -> list[str]:
    """Each address that a page or style sheet of the site would load from, with its file."""
    found = []
    for place in sorted(site.rglob("*")):
        wanted = {".html": _TAGS, ".css": _STYLES}.get(place.suffix)
        if wanted is not None:
            text = place.read_text(encoding="utf-8")
            found += [f"{place.relative_to(site)}: {to}" for to in wanted.findall(text)]
    return found
