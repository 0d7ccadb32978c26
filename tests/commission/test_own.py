"""A kind of commissioning outside the package: that of docs/own-machines.md, in a user's folder."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from tests.command import BARE
from tests.command import command as macromicro

from macromicro.commission import kinds, places
from macromicro.errors import InputError
from macromicro.schema import plugins

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "own-machines.md").read_text("utf-8")
CODE = re.findall(r"```python\n(.*?)```", TEXT, re.DOTALL)
TOML = re.findall(r"```toml\n(.*?)```", TEXT, re.DOTALL)
KIND = "mylab.commissioning:flexure"
RIG = """
from pathlib import Path

from macromicro.machines import machine, rig


def bench(seed):
    made, tree = machine.load(Path("coil.toml"))
    tree = tree.with_("timing.steps", 10)
    return rig.CompiledTwin(made.kind, tree, seed)


def no_kind():
    return 1
"""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("lab")
    (place / "mylab").mkdir()
    files = {"machines": CODE[0], "commissioning": CODE[1], "rigs": RIG}
    for name, code in files.items():
        (place / "mylab" / f"{name}.py").write_text(code, encoding="utf-8")
    (place / "coil.toml").write_text(TOML[0], encoding="utf-8")
    (place / "mylab" / "flexure.toml").write_text(TOML[1], encoding="utf-8")
    return place


def command(lab: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return macromicro(*words, cwd=lab)


@pytest.mark.slow
def test_a_machine_of_one_s_own_is_commissioned_on_a_rig_and_runs(lab: Path) -> None:
    words = ["commission", "--rig", "mylab.rigs:bench", "--kind", KIND, "--pitch", "10 nm"]
    words += ["--effort", "10 V", "--from", "0 mm", "--to", "3 mm", "--out", "found"]
    asked = command(lab, *words)
    assert asked.returncode == 2 and "confirmation needed" in asked.stderr
    done = command(lab, *words, "--yes", "--resume")
    assert done.returncode == 0, done.stderr
    assert "6 steps of effort up to 0.667 V" in done.stderr
    told = json.loads((lab / "found" / "commission.json").read_text())
    push = 12.0 * 2.4 / 4.0  # N/V, by the data sheets
    truth = {"stiffness": 2000.0 / push, "drag": (12.0**2 / 4.0 + 1.0) / push, "mass": 0.3 / push}
    for name, true in truth.items():
        assert told["model"][name]["value"] == pytest.approx(true, rel=0.02), name
    assert told["verification"]["met"] and told["gain"]["sign"] == 1.0
    text = (lab / "found" / "machine.toml").read_text()
    assert 'period = "0.0005 s"' in text  # the rig's own
    assert 'machine = "mylab.machines:flexure"' in text
    run = [*BARE, "--config", "found/machine.toml", "--json", "--out"]
    for words in ([*run, "run"], [*run, "there", "--rig", "mylab.rigs:bench", "--yes"]):
        done = command(lab, *words)
        assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("words", "match"),
    [
        (("--config", "coil.toml"), "'mylab.machines:flexure'; accepted: one of axis, piezo"),
        (("--config", "coil.toml", "--kind", "mylab.commissioning:spring"), "no spring in"),
        (("--config", "coil.toml", "--kind", "mylab.rigs:no_kind"), "procedure.Kind"),
        (("--config", "coil.toml", "--kind", "crane"), "or MODULE:KIND of your own"),
        (("--config", "coil.toml", "--kind", "piezo"), "only with --rig"),
        (("--config", str(ROOT / "examples/machines/stage.toml"), "--kind", KIND),
         "Give one for axis, the machine of --config"),
        (("--config", "coil.toml", "--kind", KIND, "--out", "no"), "give the window"),
    ],
)  # fmt: skip
def test_what_does_not_suit_is_said(lab: Path, words: tuple[str, ...], match: str) -> None:
    done = command(lab, "commission", *words)
    assert done.returncode == (1 if "window" in match else 2)
    assert match in done.stderr
    assert "Traceback" not in done.stderr


def test_an_installed_kind_is_found_by_its_machine(
    lab: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points: dict[str, str] = {"mylab.machines:flexure": KIND}
    monkeypatch.chdir(lab)
    monkeypatch.syspath_prepend(str(lab))

    def registered(group: str) -> dict[str, str]:
        return points if group == kinds.GROUP else {}

    monkeypatch.setattr(plugins, "entry_points", registered)
    place: Any = places.virtual(Path("coil.toml"))
    assert place.kind.name == "mylab.machines:flexure" and not place.kind.one_way
    points["mylab.machines:flexure"] = "mylab.rigs:no_kind"
    with pytest.raises(InputError, match=r"procedure\.Kind"):
        places.virtual(Path("coil.toml"))


BUILT = """
from macromicro.machines import machine, rig

made = machine.named({name!r}, "machine")
rig.CompiledTwin(made.kind, made.settings).read()
"""


@pytest.mark.slow  # compiles two stages into a cache of its own
def test_what_is_kept_of_it_is_in_nobody_s_way(lab: Path, tmp_path: Path) -> None:
    """A shipped machine is built where a user's was compiled before, and is no longer there."""
    env = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    for folder, name in ((lab, "mylab.machines:flexure"), (tmp_path, "axis")):
        line = [sys.executable, "-c", BUILT.format(name=name)]
        done = subprocess.run(
            line, cwd=folder, env=env, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
