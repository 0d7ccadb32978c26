"""Pages as Sphinx gets them: names of the site in links, code as links to the reference."""

from __future__ import annotations

from pathlib import Path

import pytest

from website import pages, staging


def test_links_have_the_names_of_the_site(tmp_path: Path) -> None:
    text = (
        "[a](serve.md#log) [r](../README.md) [e](https://example.org/x.md) ![p](figures/serve.png)"
    )
    assert staging.rewritten("docs/clients.md", text, tmp_path) == (
        "[a](serve.md#log) [r](readme.md) [e](https://example.org/x.md) ![p](figures/serve.png)"
    )
    text = "[a](docs/tutorials/motor.md) ![p](docs/figures/serve.png)"
    assert staging.rewritten("README.md", text, tmp_path) == (
        "[a](tutorials/motor.md) ![p](figures/serve.png)"
    )


def test_files_that_are_no_pages_come_along(tmp_path: Path) -> None:
    text = staging.rewritten("README.md", "[l](LICENSE)", tmp_path)
    assert text == "[l](files/LICENSE)" and (tmp_path / "files" / "LICENSE").is_file()


def test_code_is_linked_to_the_reference(tmp_path: Path) -> None:
    """A function under the name that the reference gives it; a name that it lacks is an error."""
    text = "[`everett.lookup`](../src/macromicro/hysteresis/everett.py)"
    assert staging.rewritten("docs/physics.md", text, tmp_path) == (
        "{py:obj}`everett.lookup <macromicro.hysteresis.lookup>`"
    )
    with pytest.raises(KeyError):
        staging.rewritten("docs/physics.md", text.replace("lookup", "nothing"), tmp_path)


def test_blocks_stay_as_they_are(tmp_path: Path) -> None:
    text = "```python\na[0](x.md)\n```\n"
    assert staging.rewritten("docs/clients.md", text, tmp_path) == text


def test_every_section_and_the_reference_are_in_the_contents() -> None:
    text = staging.contents()
    for section in pages.navigation():
        assert f":caption: {section.title}\n" in text
    assert "\n/tutorials/motor\n" in text and "\n/reference/macromicro\n" in text


def test_the_front_page_shows_the_simulated_machine_first() -> None:
    text = staging.front("# T\n\nWords.\n\n## First\n")
    assert text.index("Words.") < text.index('<iframe src="twin.html"') < text.index("## First")
    assert text.endswith(staging.contents())
