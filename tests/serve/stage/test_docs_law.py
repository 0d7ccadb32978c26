"""The law that docs/laws.md serves: it homes an axis by its gain `limit`, and moves it."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from macromicro.control.live import messages as m
from macromicro.control.live.messages import Accepted
from macromicro.errors import InputError
from macromicro.serve.settings import StageSettings, load

from .test_lines import Bed

PAGE = Path(__file__).parents[3] / "docs" / "laws.md"
BLOCK = re.compile(r"```python\n# mylab/(\w+)\.py\n(.*?)```", re.DOTALL)


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the page's modules, which can be imported from it."""
    (tmp_path / "mylab").mkdir()
    found = BLOCK.findall(PAGE.read_text(encoding="utf-8"))
    assert [name for name, _ in found] == ["laws", "served"]
    for name, code in found:
        (tmp_path / "mylab" / f"{name}.py").write_text(code, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [each for each in sys.modules if each.partition(".")[0] == "mylab"]:
        monkeypatch.delitem(sys.modules, name)
    return tmp_path


@pytest.mark.slow
def test_the_page_s_law_homes_and_moves_an_axis(lab: Path) -> None:
    file = lab / "axis.toml"
    file.write_text('machine = "axis"\nlaw = "mylab.served:sliding_mode"\n', encoding="utf-8")
    bed = Bed(file)
    assert isinstance(bed.ask(m.Enable()), Accepted)
    efforts = []
    control = bed.rig.control
    reply = bed.ask(m.Home())
    assert isinstance(reply, Accepted), reply
    for _ in range(60_000):
        bed.run(1)
        efforts.append(abs(control.efforts[0]))
        if any(getattr(n, "id", None) == reply.id for n in bed.notices):
            break
    assert bed.fault is None and bed.machine.view().motion == 0
    assert abs(bed.machine.view().offset) * bed.pitch < 2e-4
    assert 0.0 < max(efforts) < bed.tree.guard.push, "homing lowered the limit of 10 V"
    end = bed.end(m.MoveTo(0.12))
    assert end.outcome == m.DONE
    assert bed.rig._states[0].x == pytest.approx(0.12, abs=5e-4)


def test_the_option_names_it_as_well_as_the_file(lab: Path) -> None:
    law, file = "mylab.served:sliding_mode", lab / "plain.toml"
    file.write_text('machine = "axis"\n[own]\nslope = "120 1/s"\n', encoding="utf-8")
    found = load(file, law)
    assert isinstance(found, StageSettings)
    assert found.tree.law == law and found.machine.law.name == "sliding mode, served"
    assert found.controller.slope == 120.0 and found.controller.limit == 10.0
    assert [c.name for c in found.law_columns] == ["law_speed"]
    with pytest.raises(InputError, match="'served'; accepted:"):
        load(file, "served")
    pair = lab / "pair.toml"
    pair.write_text('machine = "xy"\n', encoding="utf-8")
    with pytest.raises(InputError, match="each axis has a law of its own"):
        load(pair, law)
