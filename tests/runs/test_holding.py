"""A folder of results belongs to one command at a time."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.command import command as macromicro
from tests.systems import linux, posix

from macromicro.errors import InputError
from macromicro.runs.folder import locked

HOLD = """
import sys, time
from pathlib import Path
from macromicro.runs.folder import locked
with locked(Path(sys.argv[1]), overwrite=True):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def other(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], Path]]:
    """Another process that holds the folder."""
    place = tmp_path / "results" / "mine"
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(place)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "held\n"
        yield process, place
        process.kill()


@linux
def test_one_at_a_time_and_the_other_is_named(
    other: tuple[subprocess.Popen[str], Path],
) -> None:
    process, place = other
    with pytest.raises(InputError) as caught, locked(place, overwrite=True):
        pass
    assert "in use by" in str(caught.value)
    if Path("/proc/locks").exists():
        assert f"process {process.pid} " in str(caught.value)
    assert place.is_dir()


@posix
def test_a_killed_process_holds_nothing(other: tuple[subprocess.Popen[str], Path]) -> None:
    process, place = other
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    with locked(place, overwrite=False):
        (place / "note.txt").write_text("mine")
    assert (place / "note.txt").exists()


def test_an_empty_folder_goes_again(tmp_path: Path) -> None:
    with locked(tmp_path / "deep" / "new", overwrite=False):
        assert (tmp_path / "deep" / "new").is_dir()
    assert list(tmp_path.iterdir()) == []


def test_what_another_command_left_meanwhile_is_kept(tmp_path: Path) -> None:
    (tmp_path / "note.txt").write_text("theirs")
    with pytest.raises(InputError, match="already exists"), locked(tmp_path, overwrite=False):
        pass
    with locked(tmp_path, overwrite=True):
        pass


COMMANDS = [
    ["run", "staircase"],
    ["tune", "macro"],
    ["robust"],
    ["reproduce", "--only", "M1"],
    ["collect", "dead-zone"],
]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda c: c[0])
def test_every_command_that_writes_a_folder_waits_for_none(
    command: list[str], other: tuple[subprocess.Popen[str], Path]
) -> None:
    """Exit 2, before anything is computed or removed."""
    done = macromicro(*command, "--out", other[1], "--overwrite", cwd=Path.cwd())
    assert done.returncode == 2, done.stderr
    assert "in use by" in done.stderr
