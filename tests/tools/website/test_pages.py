"""The documentation's pages: the navigation names all, links lead somewhere, figures are drawn."""

from __future__ import annotations

import ast
import re

import pytest

from website import pages, reference
from website.pages import ROOT

PAGES = pages.names()
FIGURES = sorted(p.name for p in (ROOT / "docs" / "figures").glob("*.*"))
TEXTS = {n: (ROOT / n).read_text(encoding="utf-8") for n in PAGES if n.endswith(".md")}
DOCS = [n for n in TEXTS if n.startswith("docs/")]
REFERENCES = {"docs/commands.md", "docs/scpi.md", "docs/settings.md"}  # generated: to look up


def test_the_navigation_names_every_page_once() -> None:
    listed = [name for section in pages.navigation() for name in section.pages]
    assert sorted(listed) == sorted(set(PAGES) - {pages.INDEX})
    assert {"docs/tutorials/motor.md", "docs/serve.md", "CHANGELOG.md"} <= set(listed)


def test_the_pages_are_few_and_short() -> None:
    """All pages of docs/; the words of those that are read, not looked up."""
    assert len(DOCS) <= 30
    read = [name for name in DOCS if name not in REFERENCES]
    assert sum(len(re.findall(r"[^\s|]+", TEXTS[name])) for name in read) <= 45_000


@pytest.mark.parametrize("page", [n for n in TEXTS if n.startswith("docs/") or n == "README.md"])
def test_no_paragraph_is_long(page: str) -> None:
    """Five lines of 100 letters; an item of a list counts as a paragraph."""
    for part in re.split(r"\n\s*\n|\n(?=\s*(?:-|\*|\d+\.) )", pages.prose(TEXTS[page])):
        if not part.lstrip().startswith(("|", "#", "!", "<", "$$")):
            assert len(part) <= 500, part


@pytest.mark.parametrize("page", TEXTS)
def test_no_link_within_the_repository_is_dead(page: str) -> None:
    """Files are there, and so are headings that a link names."""
    for link in pages.links(TEXTS[page]):
        if "://" in link.target:
            continue
        name, anchor = pages.linked(page, link.target)
        assert (ROOT / name).exists(), f"{page}: {link.target}"
        assert not anchor or anchor in pages.anchors(TEXTS[name]), f"{page}: {link.target}"


def test_links_and_anchors_are_found() -> None:
    text = (
        "# A `b` c\n\n    [no](no.md)\n\n[x [y]](a.md#b) ![p](q.png)\n\n"
        "```text\n# [no](no.md)\n```\n\n## A b c\n"
    )
    assert [tuple(link) for link in pages.links(text)] == [
        ("x [y]", "a.md#b", False),
        ("p", "q.png", True),
    ]
    assert pages.anchors(text) == {"a-b-c", "a-b-c-1"}
    assert pages.linked("docs/tutorials/motor.md", "../serve.md#log") == ("docs/serve.md", "log")


def functions(name: str) -> set[str]:
    """The functions at the top of a source file."""
    tree = ast.parse((ROOT / name).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_each_equation_names_the_function_that_computes_it() -> None:
    """By file and name, and the reference shows it."""
    found = []
    for link in pages.links(TEXTS["docs/physics.md"]):
        name, _ = pages.linked("docs/physics.md", link.target)
        if name.startswith("src/"):
            module, function = link.text.strip("`").split(".")
            assert name.endswith(f"/{module}.py"), link
            assert function in functions(name), link
            assert f"{reference.module(name)}.{function}" in reference.documented(), link
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
