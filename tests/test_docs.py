"""The pages in docs/ say what the code does now."""

from __future__ import annotations

import importlib.util
import re
import sys
from collections import Counter
from pathlib import Path
from types import ModuleType

import pytest

from macromicro import programme
from macromicro.machines import guard_words
from macromicro.recorded import COLUMNS
from macromicro.rig import faults
from macromicro.rig.board import protocol
from macromicro.rig.limits import Limits
from macromicro.schema.par import entries
from macromicro.settings import Settings

DOCS = Path(__file__).parents[1] / "docs"
VALIDATION = DOCS / "validation"


def loaded(name: str) -> ModuleType:
    """A maker of docs/ as a module."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(DOCS))  # makers share a module
    try:
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(DOCS))
    return module


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    """docs/make_bench.py as a module."""
    return loaded("make_bench")


def test_bench_page_is_up_to_date(maker: ModuleType) -> None:
    """Text and every default are as the code has them; `make docs` brings it up to date."""
    page = (VALIDATION / "bench.md").read_text(encoding="utf-8")
    assert page == maker.render(maker.blocks(VALIDATION / "bench.md"))


def test_the_figures_can_be_drawn_anew() -> None:
    """docs/make_figures.py has what it imports, and its pictures are there."""
    module = loaded("make_figures")
    assert module.PICTURE.is_file() and module.PROFILE.is_file() and module.PATH.is_file()
    assert len(module.draw_profile().axes) == 4
    assert len(module.draw_path().axes) == 1


def test_running_page_names_every_column() -> None:
    """With its unit."""
    text = (DOCS / "running.md").read_text(encoding="utf-8")
    table = text.partition("| columns | unit |")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| (`.*?) \| (.*?) \|", table, re.MULTILINE)
    units = {"count": "counts", "1": "-"}
    named = {}
    for names, unit in rows:
        each = re.findall(r"`(\w+)`", names)
        several = unit.split(", ") * (len(each) if ", " not in unit else 1)
        named.update(zip(each, several, strict=True))
    assert named == {c.name: units.get(c.unit, c.unit) for c in COLUMNS}


def test_troubleshooting_names_every_fault() -> None:
    """By the names that a fault message uses."""
    text = (DOCS / "troubleshooting.md").read_text(encoding="utf-8")
    for fault in (*faults.TEXTS.values(), *guard_words.TEXTS.values()):
        assert f"| {fault.name} |" in text


def test_settings_page_is_up_to_date() -> None:
    """As docs/make_settings.py writes it, with limits of the guard and parameters of the bench."""
    maker = loaded("make_settings")
    text = (DOCS / "settings.md").read_text(encoding="utf-8")
    assert text == maker.render()
    of_bench = [e for e in entries(Settings()) if e.path.startswith(("bench.", "sensors."))]
    assert len(of_bench) > 60
    for name in (*Limits._fields, *(e.path.rpartition(".")[2] for e in of_bench)):
        assert f"| `{name}` |" in text


def test_examples_page_is_up_to_date() -> None:
    """Twenty examples, whose pictures are there, and the machine files of today."""
    maker = loaded("make_examples")
    page = (DOCS / "examples.md").read_text(encoding="utf-8")
    assert maker.machines() in page
    examples = maker.EXAMPLE.findall(page)
    assert len(examples) == 20 and all(map(maker.COMMAND.findall, examples))
    shown = {name for each in examples for name in maker.PICTURE.findall(each)}
    assert shown == {
        p.relative_to(maker.PICTURES).as_posix() for p in maker.PICTURES.rglob("*.png")
    }


def test_the_wiring_diagram_shows_every_pin() -> None:
    """Once, and as many resistors to ground as there are pins that need one."""
    svg = (DOCS / "figures" / "wiring.svg").read_text(encoding="utf-8")
    labels = Counter(re.findall(r"<text[^>]*>([^<]*)</text>", svg))
    pins = [pin for pin in protocol.table("pins").values() if isinstance(pin, dict)]
    assert len(pins) > 10 and all(labels[pin["pin"]] == 1 for pin in pins)
    assert labels["R"] == sum("10 kohm to ground" in pin["to"] for pin in pins)


def test_running_page_s_examples_load(tmp_path: Path) -> None:
    """The TOML and the CSV example are programmes."""
    text = (DOCS / "running.md").read_text(encoding="utf-8")
    limits = programme.Limits(0.0, 2800.0, 0.0, 3.9e-3, 14000.0)
    toml = re.findall(r"```toml\n(.*?)```", text, re.DOTALL)[1]
    (tmp_path / "a.toml").write_text(toml, encoding="utf-8")
    assert len(programme.load(tmp_path / "a.toml", limits).target) == 9
    rows = re.findall(r"```csv\n(.*?)```", text, re.DOTALL)[0]
    (tmp_path / "a.csv").write_text(rows, encoding="utf-8")
    scheduled = programme.load(tmp_path / "a.csv", limits)
    assert scheduled.end == 8.0 and len(scheduled.target) == 4
