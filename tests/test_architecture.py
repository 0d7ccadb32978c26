"""The page of the architecture: its drawing is that of today's imports, its files exist."""

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "ARCHITECTURE.md"


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make", ROOT / "docs" / "make_architecture.py")
    assert spec is not None and spec.loader is not None
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def test_the_drawing_is_of_today(maker: ModuleType) -> None:
    """`python docs/make_architecture.py` brings it up to date."""
    page = PAGE.read_text("utf-8")
    assert maker.render(page) == page


def test_a_room_stands_above_what_it_imports_and_beside_what_imports_it_back(
    maker: ModuleType,
) -> None:
    imports = {"top": {"left", "base"}, "left": {"right"}, "right": {"left", "base"}}
    assert maker.levels(imports) == {"base": 1, "left": 2, "right": 2, "top": 3}


def test_files_that_it_names_exist() -> None:
    named = re.findall(r"`([a-z_/]+(?:\.py|/))`", PAGE.read_text("utf-8"))
    assert len(named) > 15
    missing = [name for name in named if not (ROOT / "src" / "macromicro" / name).exists()]
    beside = {"axis.py", "piezo.py", "wire.py", "compositions.py"}  # of `machines`, named before
    assert set(missing) <= beside
    assert all((ROOT / "src" / "macromicro" / "machines" / name).exists() for name in beside)
