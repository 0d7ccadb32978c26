"""The trial's section and its place."""

from __future__ import annotations

from pathlib import Path

from boardtrial import table


def test_a_second_trial_replaces_the_first_in_a_file_of_its_own_and_in_a_page(
    tmp_path: Path,
) -> None:
    alone = tmp_path / "results" / "trial.md"
    table.write(alone, "One.")
    table.write(alone, "Two.")
    assert alone.read_text() == f"{table.BEGIN}\nTwo.\n{table.END}\n"
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n\n{table.BEGIN}\nOne.\n{table.END}\n\nThe end.\n")
    table.write(page, "Two.")
    assert page.read_text() == f"# Title\n\n{table.BEGIN}\nTwo.\n{table.END}\n\nThe end.\n"
