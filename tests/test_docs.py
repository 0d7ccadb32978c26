"""The pages in docs/ say what the code does now."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import make_bench
import make_examples
import make_figures
import make_settings
import measured_page

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


def test_bench_page_is_up_to_date() -> None:
    """Text and every default are as the code has them; `make docs` brings it up to date."""
    page = (VALIDATION / "bench.md").read_text(encoding="utf-8")
    assert page == make_bench.render(measured_page.blocks(VALIDATION / "bench.md"))


def test_the_figures_can_be_drawn_anew() -> None:
    """docs/make_figures.py has what it imports, and its pictures are there."""
    assert (
        make_figures.PICTURE.is_file()
        and make_figures.PROFILE.is_file()
        and make_figures.PATH.is_file()
    )
    assert len(make_figures.draw_profile().axes) == 4
    assert len(make_figures.draw_path().axes) == 1


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
    text = (DOCS / "settings.md").read_text(encoding="utf-8")
    assert text == make_settings.render()
    of_bench = [e for e in entries(Settings()) if e.path.startswith(("bench.", "sensors."))]
    assert len(of_bench) > 60
    for name in (*Limits._fields, *(e.path.rpartition(".")[2] for e in of_bench)):
        assert f"| `{name}` |" in text


def test_examples_page_is_up_to_date() -> None:
    """Twenty examples, whose pictures are there, and the machine files of today."""
    page = (DOCS / "examples.md").read_text(encoding="utf-8")
    assert make_examples.machines() in page
    examples = make_examples.EXAMPLE.findall(page)
    assert len(examples) == 20 and all(map(make_examples.COMMAND.findall, examples))
    shown = {name for each in examples for name in make_examples.PICTURE.findall(each)}
    assert shown == {
        p.relative_to(make_examples.PICTURES).as_posix()
        for p in make_examples.PICTURES.rglob("*.png")
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
