"""Which tests stand beside a source file, and which mutants change nothing that can be seen."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "macromicro"
TESTS = ROOT / "tests"
_HERE = Path(__file__).parent

# Where a wrong sign hurts a person or a wire, every mutant must die; elsewhere nine of ten.
STRICT = (
    "rig/guard.py", "rig/guarded.py", "rig/limits.py", "rig/envelope.py", "rig/sensing.py",
    "rig/opening.py", "rig/replay.py", "control/live/",
    "machines/guarding.py", "machines/lines.py", "machines/homing.py", "serve/stage/_control.py",
    "serve/stage/_machine.py", "serve/stage/_playing.py",
)  # fmt: skip


class Equivalent(NamedTuple):
    """A mutant that no test can kill, and why."""

    file: str
    before: str
    after: str
    reason: str


def name(source: Path) -> str:
    """A source file as messages name it: its path inside the package."""
    return source.relative_to(PACKAGE).as_posix()


def required(file: str) -> float:
    """Share of a file's mutants that its tests must kill."""
    return 1.0 if file.startswith(STRICT) else 0.9


def tests(source: Path) -> list[Path]:
    """Tests beside a file: of the same name in the mirrored folder, and what is listed for the
    file or for its folder. Raises FileNotFoundError where a listed one is not there."""
    inside = source.relative_to(PACKAGE)
    folder = TESTS / inside.parent
    stem = inside.stem.strip("_")
    found = [*folder.glob(f"test_{stem}.py"), *sorted(folder.glob(f"test_{stem}_*.py"))]
    listed = tomllib.loads((_HERE / "beside.toml").read_text("utf-8"))
    keys = (inside.as_posix(), f"{inside.parent.as_posix()}/")
    more = [TESTS / path for key in keys for path in listed.get(key, [])]
    missing = [path for path in more if not path.exists()]
    if missing:
        raise FileNotFoundError(f"beside.toml names {missing[0]}, which is not there")
    return list(dict.fromkeys([*found, *more]))


def equivalents() -> list[Equivalent]:
    """The listed mutants that change nothing that can be seen."""
    listed = tomllib.loads((_HERE / "equivalent.toml").read_text("utf-8"))
    return [Equivalent(**entry) for entry in listed.get("mutant", [])]
