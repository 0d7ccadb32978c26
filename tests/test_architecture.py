"""The page of the architecture: its drawing is that of today's imports, its files exist."""

import re
from pathlib import Path

import make_architecture
import measured_page

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "ARCHITECTURE.md"


def test_the_drawing_is_of_today() -> None:
    """`python docs/make_architecture.py` brings it up to date."""
    assert measured_page.blocks(PAGE)["rooms"] == make_architecture.drawing()


def test_a_room_stands_above_what_it_imports_and_beside_what_imports_it_back() -> None:
    imports = {"top": {"left", "base"}, "left": {"right"}, "right": {"left", "base"}}
    assert make_architecture.levels(imports) == {"base": 1, "left": 2, "right": 2, "top": 3}


def test_files_that_it_names_exist() -> None:
    named = re.findall(r"`([a-z_/]+(?:\.py|/))`", PAGE.read_text("utf-8"))
    assert len(named) > 15
    missing = [name for name in named if not (ROOT / "src" / "macromicro" / name).exists()]
    beside = {"axis.py", "piezo.py", "wire.py", "compositions.py"}  # of `machines`, named before
    assert set(missing) <= beside
    assert all((ROOT / "src" / "macromicro" / "machines" / name).exists() for name in beside)
