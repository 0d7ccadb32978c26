"""``macromicro completion SHELL``: scripts for shell completion.

The script contains all words, so that Tab starts no Python.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from typing import Annotated

import typer

from macromicro.commands.tree import PROGRAM, Entry, entries


def completion(
    context: typer.Context,
    shell: Annotated[str, typer.Argument(metavar="SHELL", help="bash, zsh or fish.")],
) -> None:
    """Print a shell's completion script.

    It completes commands, options and example programmes.
    For bash: macromicro completion bash > ~/.local/share/bash-completion/completions/macromicro.
    For other shells see docs/deploy.md.
    """
    from macromicro.errors import InputError
    from macromicro.schema.text import printable

    if shell not in SCRIPTS:
        raise InputError("completion", printable(shell), f"one of {', '.join(SCRIPTS)}")
    print(SCRIPTS[shell](entries(context.find_root().command)), end="")


def offered(entry: Entry) -> list[tuple[str, str]]:
    from macromicro import programme

    if entry.path in (("run",), ("programmes",)):
        return [(name, "example programme") for name in programme.shipped()]
    if entry.path == ("completion",):
        return [(name, "") for name in SCRIPTS]
    return []


def options(entry: Entry) -> list[tuple[str, str]]:
    """Options of a command with their help, `--help` included."""
    named = [(name, o.help) for o in entry.options if not o.argument for name in o.names]
    return [*named, ("--help", "Show its help.")]


def bash(found: Sequence[Entry]) -> str:
    shorts = {entry.path: entry.short for entry in found}
    cases = []
    for entry in found:
        words = [name for name, _ in (*_commands(entry, shorts), *offered(entry))]
        flags = [name for name, _ in options(entry)]
        cases.append(
            f"    {_key(entry)}) words={shlex.quote(' '.join(words))}; "
            f"flags={shlex.quote(' '.join(flags))} ;;"
        )
    return _BASH.format(known=_known(found), cases="\n".join(cases))


def zsh(found: Sequence[Entry]) -> str:
    shorts = {entry.path: entry.short for entry in found}
    cases = []
    for entry in found:
        words = _described([*_commands(entry, shorts), *offered(entry)])
        cases.append(f"    {_key(entry)}) found=({words}); flags=({_described(options(entry))}) ;;")
    return _ZSH.format(known=_known(found), cases="\n".join(cases))


def fish(found: Sequence[Entry]) -> str:
    shorts = {entry.path: entry.short for entry in found}
    lines = []
    for entry in found:
        start = f"complete -c {PROGRAM} -n {shlex.quote(f'__{PROGRAM}_at {_key(entry)}')}"
        for name, text in (*_commands(entry, shorts), *offered(entry)):
            lines.append(f"{start} -a {shlex.quote(name)} -d {shlex.quote(text)}")
        for name, text in options(entry):
            lines.append(f"{start} -l {name.removeprefix('--')} -d {shlex.quote(text)}")
    return _FISH.format(known=_known(found, " "), lines="\n".join(lines))


def _commands(entry: Entry, shorts: dict[tuple[str, ...], str]) -> list[tuple[str, str]]:
    return [(name, shorts[(*entry.path, name)]) for name in entry.commands]


def _key(entry: Entry) -> str:
    """A command's words joined, "identify/drive"; "/" for the program itself."""
    return "/".join(entry.path) or "/"


def _known(found: Sequence[Entry], mark: str = "|") -> str:
    return mark.join(_key(entry) for entry in found if entry.path)


def _described(pairs: Sequence[tuple[str, str]]) -> str:
    """Pairs in the form that zsh's `_describe` reads."""
    return " ".join(shlex.quote(f"{name}:{text}") for name, text in pairs)


_BASH = """\
# Completion of macromicro in bash; written by `macromicro completion bash`.
_macromicro() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} path=/ next k words flags
  for ((k = 1; k < COMP_CWORD; k++)); do
    next=${{path#/}}/${{COMP_WORDS[k]}}
    next=${{next#/}}
    case $next in
    {known}) path=$next ;;
    esac
  done
  case $path in
{cases}
  esac
  if [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$flags" -- "$word"))
  else
    COMPREPLY=($(compgen -W "$words" -- "$word"))
  fi
}}
complete -o bashdefault -o default -F _macromicro macromicro
"""
_ZSH = """\
#compdef macromicro
# Completion of macromicro in zsh; written by `macromicro completion zsh`.
_macromicro() {{
  local at=/ next k
  local -a found flags
  for ((k = 2; k < CURRENT; k++)); do
    next=${{at#/}}/${{words[k]}}
    next=${{next#/}}
    case $next in
    {known}) at=$next ;;
    esac
  done
  case $at in
{cases}
  esac
  if [[ ${{words[CURRENT]}} == -* ]]; then
    _describe -o option flags
  else
    _describe command found
    _files
  fi
}}
compdef _macromicro macromicro
"""
_FISH = """\
# Completion of macromicro in fish; written by `macromicro completion fish`.
function __macromicro_at
    set -l at /
    for word in (commandline -opc)[2..-1]
        set -l next (string trim -l -c / -- "$at/$word")
        contains -- $next {known}; and set at $next
    end
    test "$at" = "$argv[1]"
end
{lines}
"""
SCRIPTS: dict[str, Callable[[Sequence[Entry]], str]] = {"bash": bash, "zsh": zsh, "fish": fish}
