"""Every block of README and docs runs as printed, in order, in a clean folder for each page.

A block that cannot run in a test is listed with the reason; any other that fails, or a listed one
that is no longer printed, fails the test.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

import tests.command
from tests import warm
from tests.systems import posix

ROOT = Path(__file__).parents[1]
PAGES = ("README.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "deploy/README.md",
         *sorted(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md")
                 if ".template." not in p.name))  # fmt: skip

# Page -> beginning of a command or of a block, and why no test runs it here.
DATA = "the reader's own data"
README = "README.md"
TESTED = "run by the tests of "
CANNOT: dict[str, dict[str, str]] = {
    "docs/calibrate.md": {"macromicro calibrate --config stage.toml --rig": "a rig"},
    "README.md": {
        "make run": "sets up an environment; CI runs its steps",
        "make serve": TESTED + "tests/commands/test_serving.py, which need no fixed port",
    },
    "CONTRIBUTING.md": {
        "make test": "these very tests",
        "make lint": "run by CI",
        "make format": "changes the checkout",
        "make mutants": "takes an hour; tests/tools runs the tool",
        ".venv/bin/python tools/mutants": TESTED + "tests/tools/test_mutants.py",
    },
    "ARCHITECTURE.md": {
        "  measure ---->": "a drawing of a period",
        "  commands ": "a drawing of the rooms, which tests/test_architecture.py makes anew",
    },
    "docs/validation/performance.md": {
        "import macromicro": "connects to the server of the step before; tests/remote does",
    },
    "docs/validation/beyond.md": {
        "macromicro identify carriage": TESTED + "tests/identify/test_carriage.py: a minute",
        "macromicro run fast --config results/carriage/model": "what that writes",
        "macromicro collect kiln": TESTED + "tests/identify/kinds/test_actuator.py",
        "macromicro identify hysteresis": TESTED + "tests/identify/kinds/test_actuator.py",
        "macromicro collect actuator": TESTED + "tests/identify/kinds/test_actuator.py",
        "macromicro identify actuator": TESTED + "tests/identify/kinds/test_actuator.py",
        "macromicro run thesis --config results/actuator/model": "what that writes",
        "macromicro robust --variants": TESTED + "tests/robustness/test_robust_command.py",
    },
    "docs/board.md": {
        "macromicro export hex": TESTED + "tests/firmware/test_build_one.py",
        "sha256sum": TESTED + "tests/firmware/test_build_one.py",
        "avrdude": TESTED + "tests/firmware/test_build_one.py",
        "macromicro doctor --rig board": TESTED + "tests/firmware/test_build_one.py",
        "macromicro commission --rig board": TESTED + "tests/firmware/test_build_one.py",
        "macromicro run --config results/commission": TESTED + "tests/firmware/test_build_one.py",
        "macromicro serve --config results/commission": TESTED + "tests/firmware/test_build_one.py",
    },
    "docs/validation/reliability.md": {
        "make trial MINUTES=60": "takes an hour: tests/firmware/test_trial.py",
        "make arm firmware-arm": "needs a compiler for the board: tests/firmware/test_mps2.py",
    },
    "docs/commissioning.md": {
        "macromicro commission --kind two_stage": TESTED
        + "tests/commands/test_commission_both.py: some minutes each",
        "macromicro commission --rig": TESTED + "tests/commission/test_command.py",
        "macromicro commission --config table.toml": TESTED
        + "tests/commission/test_plane.py: some minutes",
    },
    "deploy/README.md": {
        "make dist": TESTED + "tests/test_dist.py",
        "python3 -m venv": "installs",
        "macromicro --install-completion": "changes the shell; tests/commands/test_completion.py",
        "sudo cp": "changes the system; tests/test_deploy.py checks the unit",
        "podman build": "needs podman; tests/test_deploy.py checks the file",
        "podman run": "needs podman",
    },
    "docs/clients.md": {
        "pip install": "installs",
        "macromicro serve --epics": TESTED + "tests/serve/epics",
        "macromicro serve --gcs": TESTED + "tests/serve/gcs/test_pipython.py",
        "from macromicro.ophyd_async": TESTED + "tests/serve/epics/test_async.py",
    },
    "docs/export.md": {
        "macromicro export fmu two_stage.macro --for": TESTED + "tests/export/test_building.py",
        "// def step(": "a part of what is written, which tests/export compile",
        "cc -std=c99": TESTED + "tests/export/test_command.py",
        "from fmpy import": TESTED + "tests/export/test_fmu.py, with the extra fmu",
        "new_system(": "Simulink's",
    },
    "docs/physics.md": {" allowed error": "a drawing"},
    "docs/identify.md": {
        "macromicro identify drive own.csv": DATA,
        "macromicro collect actuator": TESTED + "tests/identify/kinds/test_actuator.py",
        "macromicro identify actuator": TESTED + "tests/identify/kinds/test_actuator.py",
        "macromicro collect carriage": TESTED + "tests/identify/test_carriage.py: a minute",
        "macromicro identify carriage": TESTED + "tests/identify/test_carriage.py: a minute",
    },
    "docs/laws.md": {
        "macromicro serve --config axis.toml": TESTED + "tests/serve/stage/test_docs_law.py",
    },
    "docs/own-machines.md": {
        "macromicro commission --rig": TESTED + "tests/commission/test_own.py",
    },
    "docs/machines.md": {
        "macromicro run --config examples/machines/xy-plotter.toml --rig": TESTED
        + "tests/machines/joint/test_rigs.py",
        "macromicro tune xy": TESTED + "tests/tuning/test_joint.py",
        "macromicro commission": TESTED + "tests/commission/test_plane.py",
        "macromicro robust --config": TESTED + "tests/robustness/test_stages.py",
        "macromicro serve": TESTED + "tests/serve/group",
        "$ nc": TESTED + "tests/serve/group/test_served.py, such",
    },
    "docs/running.md": {"n = double(h5read": "MATLAB"},
    "docs/validation/reproduce.md": {
        "macromicro collect dead-zone": TESTED + "this file: a block of docs/identify.md",
        "macromicro identify deadzone": TESTED + "this file: a block of docs/identify.md",
        "macromicro reproduce --only kiln --json": TESTED + "tests/test_cli_reproduce.py",
    },
    "docs/rigs.md": {
        "macromicro reproduce --rig mylab:bench": TESTED + "tests/test_docs_rigs.py",
        "macromicro collect --rig mylab:bench": TESTED + "tests/test_docs_rigs.py",
        "macromicro run moves.toml --rig": TESTED + "tests/test_docs_rigs.py",
        "macromicro run moves.toml --config": TESTED + "tests/machines/test_on_rig.py",
        "macromicro serve --rig mylab": TESTED + "tests/serve/test_alone.py",
        "macromicro doctor --rig mylab": TESTED + "tests/test_mylab.py",
        "macromicro run --rig replay:results/serve/live.h5": DATA,
        "macromicro run thesis --rig replay:": DATA,
        "macromicro doctor --rig multiq3.toml": "there is no card: tests/rig/test_comedi.py",
        "macromicro serve --rig multiq3.toml": "there is no card: tests/rig/test_comedi.py",
    },
    "docs/serve.md": {
        "macromicro serve": TESTED + "tests/commands/test_serving.py",
        "MACROMICRO_TOKEN=": "listens to the network",
        "export MACROMICRO_FAULTS": TESTED + "tests/rig/test_faulty.py",
        "python -m faulty": TESTED + "tests/rig/test_faulty.py",
    },
    "docs/tuning.md": {
        "pip install": "installs",
        "macromicro sweep SPEC.toml": DATA,
        'job = "macro-bench"': TESTED + "tests/sweeps/test_command.py",
        "import pyarrow": TESTED + "tests/sweeps/test_command.py",
        "macromicro sweep examples/sweep-gains.toml": TESTED + "tests/sweeps/test_command.py",
    },
    "docs/troubleshooting.md": {
        "macromicro doctor --rig mylab:bench": TESTED + "tests/test_mylab.py",
        "macromicro doctor --seconds": "needs a quiet computer; tests/commands/test_timing.py",
    },
    "docs/tutorials/motor.md": {
        "macromicro robust --config": TESTED + "tests/robustness/test_stage.py",
        "macromicro serve": TESTED + "tests/serve/stage",
        "macromicro commission --rig": TESTED + "tests/commission/test_command.py",
    },
    "docs/validation/tuning.md": {
        "alpha = 1 / max": "an equation",
        'macro_settling = "0.8 s"': TESTED + "tests/robustness/test_requirements.py",
    },
}  # fmt: skip
# What a page's TOML and CSV blocks are, in their order: files of these names.
FILES = {
    "docs/running.md": ("sticky.toml", "sequenced.toml", "scheduled.csv", "profiles.toml"),
    "docs/validation/beyond.md": ("both.toml", "draughty.toml"),
    "docs/calibrate.md": ("included.toml",),
    "docs/export.md": ("loop.toml",),
    "docs/laws.md": ("mine.toml", "axis.toml"),
    "docs/machines.md": (
        "machine.toml",
        "turntable.toml",
        "three.toml",
        "pick.toml",
        "table.toml",
        "slot.toml",
        "wave.csv",
        "switches.toml",
    ),
    "docs/own-machines.md": ("coil.toml", "mylab/flexure.toml"),
    "docs/rigs.md": ("moves.toml", "multiq3.toml", "ni.toml"),
    "docs/tuning.md": ("limits.toml",),
    "docs/tutorials/motor.md": ("axis.toml", "hobby.toml"),
}
# Commands that show that the files of a page work.
BEHIND = {"docs/laws.md": ("run staircase --config mine.toml --out results/mine",)}
OUTPUT = "console"  # lines that the commands above print, shortened


class Block(NamedTuple):
    """A block of a page: its kind ("python", "toml", ... or "commands") and text."""

    kind: str
    text: str


_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_INDENTED = re.compile(r"(?:^    .*\n)+", re.MULTILINE)


def blocks(page: str) -> list[Block]:
    """All blocks of a page, in its order; lists' own indented lines are none."""
    text = (ROOT / page).read_text(encoding="utf-8")
    found = [(m.start(), Block(m[1], m[2])) for m in _FENCE.finditer(text)]
    bare = _FENCE.sub(lambda m: re.sub(r"[^\n]", " ", m[0]).replace(" ", "."), text)
    for m in _INDENTED.finditer(bare):
        if bare[: m.start()].endswith("\n\n") and not m[0].lstrip().startswith(("-", "|")):
            found.append((m.start(), Block("", m[0])))
    ordered = [block for _, block in sorted(found, key=lambda pair: pair[0])]
    return [Block("commands", b.text) if not b.kind else b for b in ordered]


def commands(block: Block) -> list[str]:
    """The lines of a block of commands, without their comments."""
    lines = (line.strip().partition("  #")[0].strip() for line in block.text.splitlines())
    return [line for line in lines if line]


def reason(page: str, text: str) -> str:
    """Why a block or command cannot run here, or ""."""
    for start, why in CANNOT.get(page, {}).items():
        if text.startswith(start) or text.strip().startswith(start):
            return why
    return ""


def everything(page: str) -> list[str]:
    """What of a page is listed or run: whole blocks, and each command."""
    found = []
    for block in blocks(page):
        found += [block.text]
        found += commands(block) if block.kind == "commands" else []
    return found


@pytest.mark.parametrize("page", CANNOT)
def test_what_is_left_out_is_printed(page: str) -> None:
    for start in CANNOT[page]:
        assert any(t.strip().startswith(start.strip()) for t in everything(page)), start


@pytest.mark.parametrize("page", PAGES)
def test_every_block_is_run_or_listed(page: str) -> None:
    for block in blocks(page):
        if reason(page, block.text) or block.kind in ("python", "text", OUTPUT, "toml", "csv"):
            continue
        assert block.kind == "commands", f"{page}: a block of {block.kind or 'nothing'}"
        for command in commands(block):
            listed = reason(page, command)
            assert listed or command.startswith("macromicro "), f"{page}: {command}"


# How a block names a port of a server, and what stands for it in the test.
PORTS = {"scpi": ("::5025::", "::{}::"),
         "gcs": ('PISocket("127.0.0.1", 50000', 'PISocket("127.0.0.1", {}'),
         "web": ('connect("127.0.0.1"', 'connect("127.0.0.1", port={}'),
         "Web": ('Machine("127.0.0.1"', 'Machine("127.0.0.1", port={}')}  # fmt: skip
SAID = re.compile(r"(\w+): \S*?(?: port |:)(\d+)/?$")


@contextmanager
def serving(folder: Path) -> Iterator[dict[str, str]]:
    """A served virtual bench; its ports by protocol."""
    (folder / "live.toml").write_text(
        "[serve]\nmiss_share = 1.0\nloop_timeout = '5 s'\nparent_timeout = '5 s'\n"
    )
    process = warm.Command(
        [sys.executable, "-m", "macromicro", "serve", "--scpi", "0", "--web", "0", "--gcs", "0",
         "--config", "live.toml"],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        env={**os.environ, "XDG_STATE_HOME": str(folder), "MACROMICRO_TOKEN": ""},
    )  # fmt: skip
    ports: dict[str, str] = {}
    try:
        assert process.stdout is not None
        for line in process.stdout:
            found = SAID.match(line.strip())
            if found:
                ports["web" if found[1] == "page" else found[1].lower()] = found[2]
            if line.startswith("Ctrl-C"):
                break
        assert ports, "the server did not begin"
        yield ports | {"Web": ports["web"]}
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(60.0)


def python(code: str, folder: Path) -> str:
    """What a block of Python prints; blocks that name a server get one."""

    def run(code: str) -> subprocess.CompletedProcess[str]:
        line = [sys.executable, "-c", code]
        process = warm.Command(
            line, cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"}, text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        out, error = process.communicate(timeout=300)
        return subprocess.CompletedProcess(line, process.returncode, out, error)

    if any(named in code for named, _ in PORTS.values()):
        with serving(folder) as ports:
            for kind, (named, used) in PORTS.items():
                code = code.replace(named, used.format(ports[kind]))
            done = run(code)
    else:
        done = run(code)
    assert done.returncode == 0, f"{code}\n{done.stderr}"
    return done.stdout


def command(words: str, folder: Path) -> str:
    """What a command of the package prints, with patterns of files and ` > file` as in a shell."""
    given: list[str] = []
    words, _, kept = words.partition(" > ")
    for word in shlex.split(words):
        paths = sorted(str(p.relative_to(folder)) for p in folder.glob(word)) if "*" in word else []
        given += paths or [word]
    done = tests.command.command(*given, cwd=folder)
    assert done.returncode == 0, f"{words}: {done.stderr}"
    if kept:
        (folder / kept).write_text(done.stdout, encoding="utf-8")
    return done.stdout + done.stderr


def lines(text: str) -> set[str]:
    """Its lines, each with single spaces."""
    return {" ".join(line.split()) for line in text.splitlines() if line.strip()}


@posix
@pytest.mark.slow
@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p)])
def test_blocks_run_as_printed(page: str, tmp_path: Path) -> None:
    """Files that a page shows are there under the names it uses for them."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    # A page may show a file behind the command that takes it.
    shown = [b for b in blocks(page) if b.kind in ("toml", "csv") and not reason(page, b.text)]
    for name, block in zip(FILES.get(page, ()), shown, strict=True):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(block.text, encoding="utf-8")
    said, printed = "", ""
    for block in blocks(page):
        if block.kind == "python" and not reason(page, block.text):
            named = re.match(r"# ([\w/]+\.py)\n", block.text)
            if named:
                (tmp_path / named[1]).parent.mkdir(exist_ok=True)
                (tmp_path / named[1]).write_text(block.text, encoding="utf-8")
            else:
                said = python(block.text, tmp_path)
        elif block.kind == "text" and not reason(page, block.text):
            assert said == block.text
        elif block.kind == OUTPUT:
            assert lines(block.text) <= lines(printed), lines(block.text) - lines(printed)
        elif block.kind == "commands" and not reason(page, block.text):
            for line in commands(block):
                if not reason(page, line):
                    printed += command(line.removeprefix("macromicro "), tmp_path)
    for words in BEHIND.get(page, ()):
        command(words, tmp_path)
