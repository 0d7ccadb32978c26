"""`macromicro completion`: what the shells themselves make of the scripts."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from macromicro import cli, programme
from macromicro.commands.completion import SCRIPTS
from macromicro.commands.tree import entries

TRIES = {
    "re": ["reproduce", "response"],
    "identify dr": ["drive"],
    "identify drive --col": ["--columns"],
    "config show --mac": ["--machine"],
    "run --out run --ove": ["--overwrite"],
    "run thes": ["thesis"],
    "completion f": ["fish"],
    "--ver": ["--version"],
    "compare nothing-such": [],
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scripts, each named after its shell, in a folder without other files."""
    place = tmp_path_factory.mktemp("completion")
    found = entries(typer.main.get_command(cli.app))
    for shell, script in SCRIPTS.items():
        (place / shell).write_text(script(found), encoding="utf-8")
    return place


def shell(name: str, text: str, folder: Path) -> list[str]:
    """The lines that a shell prints."""
    if shutil.which(name) is None:
        pytest.skip(f"no {name} here")
    flag = {"bash": "--norc", "zsh": "-f", "fish": "--no-config"}[name]
    done = subprocess.run(
        [name, flag, "-c", text], cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    return done.stdout.splitlines()


def test_bash_completes_commands_options_and_programmes(folder: Path) -> None:
    lines = ["source ./bash", "complete -p macromicro"]
    for words in TRIES:
        lines.append(
            f"COMP_WORDS=(macromicro {words}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); "
            'COMPREPLY=(); _macromicro; echo "${COMPREPLY[*]}"'
        )
    registered, *found = shell("bash", "\n".join(lines), folder)
    assert registered == "complete -o bashdefault -o default -F _macromicro macromicro"
    assert dict(zip(TRIES, map(str.split, found), strict=True)) == TRIES
    text = (
        'source ./bash; COMP_WORDS=(macromicro ""); COMP_CWORD=1; _macromicro; echo ${COMPREPLY[@]}'
    )
    group = typer.main.get_command(cli.app)
    assert shell("bash", text, folder)[0].split() == list(group.commands)  # type: ignore[attr-defined]


def test_fish_completes_them_with_what_they_mean(folder: Path) -> None:
    for words, wanted in TRIES.items():
        found = shell("fish", f"source ./fish; complete -C 'macromicro {words}'", folder)
        # Options and commands that only contain the letters may follow.
        assert [line.partition("\t")[0] for line in found][: len(wanted)] == wanted, words
        assert all(line.partition("\t")[2] for line in found[: len(wanted)]) or "fish" in wanted


def test_zsh_takes_the_script(folder: Path) -> None:
    shell("zsh", "source =(print 'compdef() {}'); source ./zsh; whence -w _macromicro", folder)


def test_the_command_prints_a_script(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["macromicro", "completion", "bash"])
    assert cli.main() == 0
    script = capsys.readouterr().out
    assert script == (folder / "bash").read_text()
    assert all(name in script for name in programme.shipped())
    monkeypatch.setattr(sys, "argv", ["macromicro", "completion", "tcsh"])
    assert cli.main() == 2
    assert "completion: 'tcsh'; accepted: one of bash, zsh, fish" in capsys.readouterr().err
