"""A section of a page and its place."""

from __future__ import annotations

from pathlib import Path

import sections


def test_a_second_section_replaces_the_first_in_a_file_of_its_own_and_in_a_page(
    tmp_path: Path,
) -> None:
    alone = tmp_path / "results" / "trial.md"
    sections.write(alone, "trial", "One.\n")
    sections.write(alone, "trial", "Two.")
    text = "<!-- trial: begin -->\nTwo.\n<!-- trial: end -->\n"
    assert alone.read_text() == text
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n\n{text.replace('Two', 'One')}\nThe end.\n")
    sections.write(page, "trial", "Two.")
    assert page.read_text() == f"# Title\n\n{text}\nThe end.\n"
