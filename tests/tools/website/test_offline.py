"""What a built page would load from elsewhere is found; links that a reader follows are not."""

from __future__ import annotations

from pathlib import Path

from website import offline


def test_sources_elsewhere_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<a href="https://example.org/">x</a> <script src="scripts/a.js"></script>\n'
        '<script async src="https://cdn.example/m.js"></script>\n'
        '<link rel="stylesheet" href="//fonts.example/f.css"> <img alt="" src=\'http://p.example/q\'>'
    )
    (tmp_path / "b.css").write_text('@import "https://i.example/i.css"; a { b: url(local.woff) }')
    assert offline.fetched(tmp_path) == [
        "a.html: https://cdn.example/m.js",
        "a.html: //fonts.example/f.css",
        "a.html: http://p.example/q",
        "b.css: https://i.example/i.css",
    ]
