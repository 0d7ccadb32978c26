"""The commands as data, and docs/commands.md, which is written from them."""

from __future__ import annotations

from pathlib import Path

import make_commands
from command_tree import entries
from typer.testing import CliRunner

from macromicro.cli import app, command_line

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_is_up_to_date() -> None:
    """`python docs/make_commands.py` brings it up to date."""
    assert (DOCS / "commands.md").read_text(encoding="utf-8") == make_commands.render()


def test_every_line_of_a_list_of_commands_is_whole_at_80_columns() -> None:
    groups = [entry for entry in entries(command_line()) if entry.commands]
    assert {entry.path for entry in groups} == {(), ("config",), ("identify",), ("export",)}
    for entry in groups:
        shown = CliRunner().invoke(app, [*entry.path, "--help"], env={"COLUMNS": "80"}).stdout
        _, _, listed = shown.partition("Commands:\n")
        lines = listed.splitlines()
        assert [line.split()[0] for line in lines] == list(entry.commands)
        assert not [line for line in lines if line.endswith("...") or len(line) > 80]


def test_every_command_has_its_help_and_options() -> None:
    found = {" ".join(e.path): e for e in entries(command_line())}
    assert found[""].commands[:2] == ("run", "programmes") and found[""].options[0].names == (
        "--version",
    )
    assert {"config show", "identify drive", "export c"} < set(found)
    for name, entry in found.items():
        assert entry.short and "\n" not in entry.short, name
        for option in entry.options:
            assert option.help, (name, option.names)
    run = {o.names[0]: o for o in found["run"].options}
    assert "--help" not in run
    assert run["PROGRAMME"].argument and not run["PROGRAMME"].required
    assert (run["--seed"].takes, run["--seed"].default) == ("N", "0")
    assert (run["--fan"].takes, run["--fan"].default) == ("", "")
    assert run["--out"].default == "results/<programme>"
    plot = {o.names[0]: o for o in found["plot"].options}
    assert plot["FILE"].required and plot["COLUMNS"].many and plot["--out"].many
