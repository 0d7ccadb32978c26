"""Texts that people read: no word of tools/words.toml in documents, messages, pages or help."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "macromicro"
WORDS = tomllib.loads((ROOT / "tools/words.toml").read_text(encoding="utf-8"))["word"]
# What is read of a file: not its code. Scripts and tables: quoted text of several words.
CODE = {
    ".md": re.compile(r"`[^`]*`|^    .*"),
    ".html": re.compile(r"<[^>]*>"),
}
QUOTED = re.compile(r'"[^"\n]* [^"\n]*"')


def documents() -> list[Path]:
    """Pages for readers, and files of the package whose text people see."""
    pages = [ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md")]
    found = (*(ROOT / "docs").rglob("*.md"), *PACKAGE.rglob("*"))
    return sorted([*pages, *(f for f in found if f.suffix in (*CODE, ".js", ".toml"))])


def read(file: Path, line: str) -> str:
    """What people read of a line."""
    code = CODE.get(file.suffix)
    return code.sub("", line) if code else " ".join(QUOTED.findall(line))


def strings(tree: ast.AST, helps: bool) -> Iterator[tuple[int, str]]:
    """Strings of several words of a module, by line: no docstrings, but those that are helps."""
    silent = set()
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and body and isinstance(body[0], ast.Expr) and not helps:
            silent.add(id(body[0].value))
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in silent:
            text = node.value
            if isinstance(text, str) and " " in text.strip():
                yield node.lineno, text


@cache
def texts() -> list[tuple[str, str]]:
    """All texts, each with its place."""
    return [(at, text) for at, text in _texts() if text.strip()]


def _texts() -> Iterator[tuple[str, str]]:
    for file in documents():
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
            yield f"{file.relative_to(ROOT)}:{number}", read(file, line)
    for file in sorted(PACKAGE.rglob("*.py")):
        helps = file.parent.name == "commands" or file.name == "cli.py"
        for number, text in strings(ast.parse(file.read_text(encoding="utf-8")), helps):
            yield f"{file.relative_to(ROOT)}:{number}", text


@pytest.mark.parametrize("word", WORDS, ids=[word["pattern"] for word in WORDS])
def test_a_word_stays_away(word: dict[str, str]) -> None:
    found = [f"{at}: {text}" for at, text in texts() if re.search(word["pattern"], text, re.I)]
    assert not found, f"write {word['write']}:\n" + "\n".join(found)
