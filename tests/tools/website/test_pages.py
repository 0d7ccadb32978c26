"""The documentation's pages: the navigation names all, links lead somewhere, figures are drawn."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from tests import public_names
from website import pages
from website.pages import ROOT

INDEX = "docs/index.md"
BESIDE = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "deploy/README.md")
PAGES = [
    *BESIDE,
    *sorted(
        path.relative_to(ROOT).as_posix()
        for pattern in ("docs/**/*.md", "notebooks/*.ipynb")
        for path in ROOT.glob(pattern)
        if ".template." not in path.name
    ),
]
FIGURES = sorted(p.name for p in (ROOT / "docs" / "figures").glob("*.*"))
TEXTS = {n: (ROOT / n).read_text(encoding="utf-8") for n in PAGES if n.endswith(".md")}
DOCS = [n for n in TEXTS if n.startswith("docs/")]
REFERENCES = {"docs/commands.md", "docs/scpi.md", "docs/settings.md"}  # generated: to look up


CODE = re.compile(r"^```.*?^```$|^(?:    [^\n]*\n)+", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
HEADING = re.compile(r"^(#+) (.+)$", re.MULTILINE)


class Link(NamedTuple):
    """A link or picture of a page: what is shown, and where it leads."""

    text: str
    target: str
    picture: bool


def prose(text: str) -> str:
    """A page without its blocks of code."""
    return CODE.sub("", text)


def links(text: str) -> Iterator[Link]:
    """The links and pictures of a page, in order."""
    for found in LINK.finditer(prose(text)):
        yield Link(found[2], found[3], found[1] == "!")


def linked(page: str, target: str) -> tuple[str, str]:
    """Where a link of `page` leads: a path from the root, and an anchor or ""."""
    path, _, anchor = target.partition("#")
    place = (ROOT / page).parent / path if path else ROOT / page
    return place.resolve().relative_to(ROOT).as_posix(), anchor


def anchors(text: str) -> set[str]:
    """The anchors of a page's headings, by the rule of Git hosts."""
    found: set[str] = set()
    for match in HEADING.finditer(re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.M)):
        slug = re.sub(r"[^\w\- ]", "", match[2].lower()).replace(" ", "-")
        number = 1
        while slug in found:
            slug = f"{slug.removesuffix(f'-{number - 1}')}-{number}"
            number += 1
        found.add(slug)
    return found


def test_the_navigation_names_every_page_once() -> None:
    """And the pages of the reference behind them."""
    listed = re.findall(r"^[\w./-]+$", pages.contents(TEXTS[INDEX]), re.MULTILINE)
    places = [Path(linked(INDEX, name)[0]) for name in listed]
    expected = [Path(name).with_suffix("") for name in PAGES if name != INDEX]
    reference = [p.relative_to(ROOT).with_suffix("") for p in public_names.REFERENCE.glob("*.rst")]
    assert sorted(places) == sorted([*expected, *reference])


def test_the_pages_are_few_and_short() -> None:
    """All pages of docs/; the words of those that are read, not looked up."""
    assert len(DOCS) <= 30
    read = [name for name in DOCS if name not in REFERENCES]
    assert sum(len(re.findall(r"[^\s|]+", TEXTS[name])) for name in read) <= 45_000


@pytest.mark.parametrize("page", [n for n in TEXTS if n.startswith("docs/") or n == "README.md"])
def test_no_paragraph_is_long(page: str) -> None:
    """Five lines of 100 letters; an item of a list counts as a paragraph."""
    for part in re.split(r"\n\s*\n|\n(?=\s*(?:-|\*|\d+\.) )", prose(TEXTS[page])):
        if not part.lstrip().startswith(("|", "#", "!", "<", "$$")):
            assert len(part) <= 500, part


@pytest.mark.parametrize("page", TEXTS)
def test_no_link_within_the_repository_is_dead(page: str) -> None:
    """Files are there, and so are headings that a link names."""
    for link in links(TEXTS[page]):
        if "://" in link.target:
            continue
        name, anchor = linked(page, link.target)
        assert (ROOT / name).exists(), f"{page}: {link.target}"
        assert not anchor or anchor in anchors(TEXTS[name]), f"{page}: {link.target}"


def test_links_and_anchors_are_found() -> None:
    text = (
        "# A `b` c\n\n    [no](no.md)\n\n[x [y]](a.md#b) ![p](q.png)\n\n"
        "```text\n# [no](no.md)\n```\n\n## A b c\n"
    )
    assert [tuple(link) for link in links(text)] == [
        ("x [y]", "a.md#b", False),
        ("p", "q.png", True),
    ]
    assert anchors(text) == {"a-b-c", "a-b-c-1"}
    assert linked("docs/tutorials/motor.md", "../serve.md#log") == ("docs/serve.md", "log")


def functions(name: str) -> set[str]:
    """The functions at the top of a source file."""
    tree = ast.parse((ROOT / name).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_each_equation_names_the_function_that_computes_it() -> None:
    """By file and name, and the reference shows it under the name that the site links."""
    names = {n.name for module in public_names.shown() for n in public_names.public(module)}
    found = []
    for link in links(TEXTS["docs/physics.md"]):
        name, _ = linked("docs/physics.md", link.target)
        if name.startswith("src/"):
            module, function = link.text.strip("`").split(".")
            assert name.endswith(f"/{module}.py"), link
            assert function in functions(name), link
            role = pages.linked(f"[{link.text}]({link.target})")
            assert re.fullmatch(r"\{py:obj\}`\S+ <(\S+)>`", role)[1] in names, link  # type: ignore[index]
            found.append(link)
    assert len(found) > 40


def test_each_paragraph_of_equations_names_a_function() -> None:
    """No equation stands in a part of the physics chapter that links no code."""
    for part in re.split(r"^#+ .*$", TEXTS["docs/physics.md"], flags=re.MULTILINE):
        assert "$$" not in part or "../src/" in part, part


@pytest.mark.parametrize("figure", FIGURES)
def test_every_figure_is_on_a_page_and_drawn_by_a_script(figure: str) -> None:
    """Which make runs; diagrams may be drawn by hand."""
    assert any(f"figures/{figure})" in text for text in TEXTS.values())
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    makers = [ROOT / name for name in set(re.findall(r"docs/make_\w+\.py", makefile))]
    drawn = any(figure in maker.read_text(encoding="utf-8") for maker in makers)
    assert drawn or figure.endswith(".svg")


def test_code_is_linked_to_the_reference() -> None:
    """A function or a module; what is no source code stays as it is."""
    text = "[`everett.lookup`](../src/macromicro/hysteresis/everett.py) [a](serve.md#log)"
    assert pages.linked(text) == (
        "{py:obj}`everett.lookup <macromicro.hysteresis.everett.lookup>` [a](serve.md#log)"
    )
    text = "[`belt`](../src/macromicro/plant/belt.py)"
    assert pages.linked(text) == "{py:mod}`belt <macromicro.plant.belt>`"


def test_the_front_page_shows_the_simulated_machine_first() -> None:
    text = pages.front("# T\n\nWords.\n\n## First\n\n[a](a.md) [b](b.md#part)\n")
    assert text.index("Words.") < text.index("<iframe") < text.index("## First")
    assert ":caption: First\n\na\n```" in text and "\nreference/macromicro\n" in text


def test_sources_elsewhere_are_found(tmp_path: Path) -> None:
    """What a built page would load from elsewhere, not the links that a reader follows."""
    (tmp_path / "a.html").write_text(
        '<a href="https://example.org/">x</a> <script src="scripts/a.js"></script>\n'
        '<script async src="https://cdn.example/m.js"></script>\n'
        '<link rel="stylesheet" href="//fonts.example/f.css"> <img alt="" src=\'http://p.example/q\'>'
    )
    (tmp_path / "b.css").write_text('@import "https://i.example/i.css"; a { b: url(local.woff) }')
    assert pages.fetched(tmp_path) == [
        "a.html: https://cdn.example/m.js",
        "a.html: //fonts.example/f.css",
        "a.html: http://p.example/q",
        "b.css: https://i.example/i.css",
    ]
