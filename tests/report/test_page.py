"""The page opens without a network, hides nothing, and runs no one's text as HTML."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser

import pytest

from macromicro.drawing import files
from macromicro.drawing.page import Picture
from macromicro.report import _figures, run, two_stage
from macromicro.rig import codes, guard
from macromicro.rig.faults import describe
from macromicro.runs.job import Ended

WHEN = "2026-01-02 03:04:05+00:00"
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Parsed(HTMLParser):
    """Tags with attributes, the text, and whether every tag was closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


def page(ended: Ended, pictures: list[Picture]) -> str:
    return run.page(ended, two_stage.report(ended, WHEN), pictures)


@pytest.fixture(scope="module")
def pictures(ended: Ended) -> list[Picture]:
    return [
        Picture(d.name, d.title, d.caption, files.encode(d.figure)) for d in _figures.draw(ended)
    ]


@pytest.fixture(scope="module")
def parsed(ended: Ended, pictures: list[Picture]) -> Parsed:
    return Parsed(page(ended, pictures))


def test_is_well_formed(parsed: Parsed) -> None:
    assert parsed.open == []


def test_needs_no_network_and_no_script(
    ended: Ended, pictures: list[Picture], parsed: Parsed
) -> None:
    names = [tag for tag, _ in parsed.tags]
    assert not {"script", "link", "iframe", "object", "base"} & set(names)
    for tag, attributes in parsed.tags:
        for key, value in attributes.items():
            assert not key.startswith("on")
            if key in ("src", "href", "srcset", "data", "action"):
                assert value is not None and value.startswith("data:image/png;base64,"), tag
    text = page(ended, pictures)
    bare = re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)
    assert "http:" not in bare and "https:" not in bare
    assert not re.search(r"""["'(=]\s*//""", bare)
    assert "@import" not in bare and "url(" not in bare


def test_every_picture_is_a_png_inline(pictures: list[Picture], parsed: Parsed) -> None:
    images = [attributes for tag, attributes in parsed.tags if tag == "img"]
    assert len(images) == len(pictures) >= 5
    for image in images:
        data = base64.b64decode(str(image["src"]).partition(",")[2], validate=True)
        assert data.startswith(b"\x89PNG")
        assert image["alt"]


def test_readable_in_the_dark_and_on_a_phone(ended: Ended) -> None:
    text = page(ended, [])
    assert "prefers-color-scheme: dark" in text
    assert 'name="viewport" content="width=device-width' in text


def test_says_what_when_and_how(ended: Ended, parsed: Parsed) -> None:
    assert WHEN in parsed.text and "seed 3" in parsed.text and "2 cycles" in parsed.text
    assert "sensors.laser.noise = 0.5 um" in parsed.text
    assert "The programme finished: 10 of 10 moves arrived; worst " in parsed.text
    rows = [tag for tag, attributes in parsed.tags if tag == "tr"]
    assert len(rows) == 1 + len(ended.moves)


def test_text_of_the_user_is_escaped(ended: Ended, parsed: Parsed) -> None:
    assert "b" not in [tag for tag, _ in parsed.tags]
    assert "Short <b>& quick</b>" in parsed.text


def test_shows_the_fault(ended: Ended) -> None:
    watch = guard.fresh()._replace(fault=codes.STUCK, value=3.7, limit=0.251, time=2.0)
    fault = describe(watch)
    assert fault is not None
    found = Parsed(page(ended._replace(finished=False, fault=fault), [])).text
    assert "The programme finished" not in found
    for part in (fault.name, fault.message, fault.evidence, fault.remedy):
        assert part in found
