"""``macromicro doctor --rig NAME --open`` and ``--move``: statuses, words, and what is asked."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.command import command as macromicro
from tests.systems import posix

PAGE = Path(__file__).parents[2] / "docs" / "rigs.md"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the page's rig, and one that shows too much."""
    folder = tmp_path_factory.mktemp("lab")
    rig = re.findall(r"```python\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)[0]
    odd = 'class Odd(Carriage):\n    channels = ("encoder", "hall")\n'
    made = "def odd(seed):\n    return Odd()\n"
    for name, what in (("slow", "Carriage"), ("slow_odd", "Odd")):
        made += f"def {name}(seed):\n    made = {what}()\n    made.dt = 2e-3\n    return made\n"
    (folder / "mylab.py").write_text(f"{rig}\n\n{odd}\n\n{made}", encoding="utf-8")
    return folder


def doctor(lab: Path, *options: str) -> subprocess.CompletedProcess[str]:
    return macromicro("doctor", *options, cwd=lab)


@posix
def test_the_page_s_rig_keeps_everything_moved_too(lab: Path) -> None:
    done = doctor(lab, "--rig", "mylab:bench", "--move", "3 V", "--yes", "--json")
    assert done.returncode == 0, done.stdout
    seen = {each["what"]: each for each in json.loads(done.stdout)}
    assert seen["direction"]["found"] == "3 V: +200 counts, -3 V: -200 counts"
    assert seen["killed process"]["found"].startswith("opened again after SIGKILL")
    assert "motor 3 V, then -3 V" in done.stderr


def test_a_rig_of_one_stage_has_a_period_of_its_own(lab: Path) -> None:
    done = doctor(lab, "--rig", "mylab:slow", "--open")
    # It says 2 ms and keeps 1 ms.
    assert "a period of 1 ms in the mean, for 2 ms" in done.stdout, done.stdout + done.stderr
    done = doctor(lab, "--rig", "mylab:slow_odd", "--open")
    assert done.returncode == 2 and "dt: '0.002 s'; accepted: 0.001 s" in done.stderr


def test_the_rigs_of_two_axes_are_looked_at_one_after_the_other(lab: Path) -> None:
    done = doctor(lab, "--rig", "mylab:bench+mylab:odd", "--open", "--json")
    assert done.returncode == 1, done.stderr
    found = {each["what"]: each["state"] for each in json.loads(done.stdout)}
    first, second = ({w: s for w, s in found.items() if w.startswith(f"mylab:{name}, ")}
                     for name in ("bench", "odd"))  # fmt: skip
    assert set(first.values()) == {"ok"} and "fail" in second.values()
    assert len(first) + len(second) == len(found)


def test_nothing_moves_where_nobody_can_be_asked(lab: Path) -> None:
    done = doctor(lab, "--rig", "mylab:bench", "--move", "3 V")
    assert done.returncode == 2
    assert "confirmation needed" in done.stderr
    assert "direction" not in done.stdout


def test_a_rig_that_fails_is_not_moved(lab: Path) -> None:
    done = doctor(lab, "--rig", "mylab:odd", "--move", "3 V", "--yes")
    assert done.returncode == 1
    assert "fail channels: no value of hall in 501 readings" in done.stdout
    assert "direction" not in done.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--open",), "--rig: the simulated machine needs no check"),
        (("--rig", "mylab:bench", "--move", "11 V"), "--move: '11 V'; accepted: more than 0 V"),
        (("--rig", "mylab:bench", "--move", "3"), "--move: '3'"),
    ],
)
def test_what_is_not_accepted(lab: Path, options: tuple[str, ...], message: str) -> None:
    done = doctor(lab, *options)
    assert done.returncode == 2
    assert message in done.stderr


def test_a_walk_drives_the_page_s_rig(lab: Path) -> None:
    done = doctor(lab, "--rig", "mylab:bench", "--walk", "--move", "4 V", "--yes", "--json")
    assert done.returncode == 0, done.stdout
    seen = {each["what"]: each for each in json.loads(done.stdout)}
    assert list(seen) == ["direction", "ends", "walk"]
    assert "3141 counts from -141 to 3000" in seen["ends"]["found"]
    assert seen["walk"]["found"] == "right: direction, ends; skipped: encoder"
    assert "to 4 V at most" in done.stderr
    assert "Push the stage" not in done.stderr


@posix
def test_a_walk_asks_before_each_step(lab: Path) -> None:
    """With a person, which is a terminal here: y, and then something else."""
    import pty

    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "macromicro", "doctor", "--rig", "mylab:bench", "--walk"]
    try:
        os.write(ours, b"s\ny\nno\n")
        done = subprocess.run(
            command, cwd=lab, stdin=theirs, capture_output=True, text=True, check=False
        )
    finally:
        os.close(ours)
        os.close(theirs)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("y: do it, s: skip it, any other key ends:") == 3
    assert "walk: right: direction; skipped: encoder, ends" in done.stdout


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--walk",), "confirmation needed"),
        (("--walk", "--yes", "--heat", "0 V"), "--heat: '0 V'; accepted: more than 0 V"),
        (("--heat", "1 V"), "--heat: only with --walk"),
    ],
)
def test_what_a_walk_does_not_accept(lab: Path, options: tuple[str, ...], message: str) -> None:
    done = doctor(lab, "--rig", "mylab:bench", *options)
    assert done.returncode == 2
    assert message in done.stderr


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--walk", "--law", "mylab:law"), "--law: not together with --walk"),
        (("--machine", "mylab:axis", "--open"), "--machine: not together with --open or --move"),
        (("--machine", "mylab:axis", "--heat", "1 V"), "--heat: only with --walk"),
    ],
)
def test_one_check_at_a_time(lab: Path, options: tuple[str, ...], said: str) -> None:
    done = doctor(lab, *options)
    assert done.returncode == 2 and said in done.stderr
