"""Writes docs/commands.md: every command with its arguments and options, as `--help` has them.

python docs/make_commands.py
"""

from __future__ import annotations

from pathlib import Path

from command_tree import PROGRAM, Entry, Option, entries
from measured_page import table

from macromicro.cli import command_line

PAGE = Path(__file__).with_name("commands.md")
HEAD = """\
# Commands

This page collects the output of `macromicro COMMAND --help`; `docs/make_commands.py` generates it.
Exit status: 0; 1 if a command failed or was stopped; 2 for bad input; 130 after Ctrl-C. `macromicro
--version` prints the version.

"""


def render() -> str:
    """The page."""
    found = entries(command_line())
    commands = [entry for entry in found if entry.path]
    rows = [(f"[{_name(e)}](#{_anchor(e)})", _cell(e.short)) for e in commands]
    listed = table(("command", "what it does"), rows)
    return HEAD + listed + "\n" + "\n".join(map(section, commands))


def section(entry: Entry) -> str:
    """A command: how it is called, what it does, its arguments and options."""
    parts = [f"## {_name(entry)}", f"`{' '.join([_name(entry), *_usage(entry)])}`", entry.help]
    if entry.options:
        rows = [(_typed(o), _cell(o.help), _cell(o.default)) for o in entry.options]
        parts.append(table(("option", "what", "default"), rows).rstrip())
    return "\n\n".join(parts) + "\n"


def _usage(entry: Entry) -> list[str]:
    words = [] if not entry.commands else ["COMMAND"]
    words += ["[OPTIONS]"] if any(not o.argument for o in entry.options) else []
    for each in entry.options:
        if each.argument:
            word = each.names[0] + ("..." if each.many and "..." not in each.names[0] else "")
            words.append(word if each.required else f"[{word}]")
    return words


def _typed(option: Option) -> str:
    text = ", ".join(option.names) + (f" {option.takes}" if option.takes else "")
    again = ", may be repeated" if option.many and not option.argument else ""
    return f"`{_cell(text)}`{again}"


def _name(entry: Entry) -> str:
    return " ".join((PROGRAM, *entry.path))


def _anchor(entry: Entry) -> str:
    return _name(entry).replace(" ", "-")


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


if __name__ == "__main__":
    PAGE.write_text(render(), encoding="utf-8")
