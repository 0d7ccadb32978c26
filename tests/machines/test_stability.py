"""Gains with which a linear loop is unstable are refused, with the bound; machines of examples."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro.control import stability as macro
from macromicro.control.live import gains
from macromicro.control.live import messages as m
from macromicro.control.macro import LAWS
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.machines import _stability, loops
from macromicro.schema.config import problems
from macromicro.schema.par import entries, replaced
from macromicro.serve import settings as serve_settings
from macromicro.serve.settings import LiveSettings
from tests.control.live.test_moves import ready
from tests.serve.stage.bed import Bed

MACHINES = Path(__file__).parents[2] / "examples" / "machines"
FILES = sorted(f for f in MACHINES.glob("*.toml") if f.stem != "xyz")  # which is not served


def axes(file: Path) -> list[Any]:
    tree = serve_settings.load(file).tree  # type: ignore[union-attr]
    return [tree] if hasattr(tree, "controller") else [tree.x, tree.y]


TREES = [
    pytest.param(tree, id=f"{file.stem}-{k}") for file in FILES for k, tree in enumerate(axes(file))
]


@pytest.mark.parametrize("tree", TREES)
def test_the_gains_of_the_data_sheets_are_taken_and_absurd_ones_refused(tree: Any) -> None:
    """Each number of each law, with the others as they are; what names no effort aside."""
    assert list(problems(tree)) == []
    harmless = ("hangs", "observer", "notch.")
    for entry in entries(tree.controller):
        path = f"controller.{entry.path}"
        if not isinstance(entry.value, float) or entry.path.startswith(harmless):
            continue
        found = list(problems(replaced(tree, path, 1e9)))
        assert found and found[0][0] == path, path
        assert any(c.isdigit() for c in found[0][2])


@pytest.mark.parametrize("name", ["position", "integral"])
@pytest.mark.parametrize("file", ["printer", "emps", "servo", "disc"])
def test_the_bound_that_a_refusal_names_is_taken_and_a_little_more_is_not(
    file: str, name: str
) -> None:
    (tree,) = axes(MACHINES / f"{file}.toml")
    path = f"controller.{name}"
    (found,) = problems(replaced(tree, path, 1e4))
    bound = float(found[2].removeprefix("at most ").split()[0])
    assert list(problems(replaced(tree, path, 0.99 * bound))) == []
    assert len(list(problems(replaced(tree, path, 1.03 * bound)))) == 1


def test_a_slow_observer_is_refused_from_the_other_side() -> None:
    (tree,) = axes(MACHINES / "printer.toml")
    (found,) = problems(replaced(tree, "controller.observer", 50.0))
    assert found[0] == "controller.observer" and found[2].startswith("at least ")


def test_nyquist_agrees_with_the_poles() -> None:
    """Of a double integrator behind a hold, under PD laws."""
    dt = 1e-3
    f = loops.grid(dt, 1e-9 / dt)
    z = np.exp(2j * np.pi * f * dt)
    plant = 0.5 * dt * dt * (z + 1.0) / (z - 1.0) ** 2
    seen = set()
    for kp in (1.0, 1e3, 1e5, 1e6):
        for kd in (1.0, 1e3, 1e5, 9e5, 1.9e6, 3e6):
            law = kp + kd * (1.0 - 1.0 / z)
            num = np.convolve([kp + kd, -kd], [0.5 * dt * dt, 0.5 * dt * dt])
            poles = np.roots(np.polyadd(num, [1.0, -2.0, 1.0, 0.0]))
            holds = bool(np.all(np.abs(poles) < 1.0))
            assert _stability.stable(plant * law, f) == holds, (kp, kd)
            seen.add(holds)
    assert seen == {True, False}


def test_it_is_judged_between_two_periods() -> None:
    """A refusal takes about 10 ms; bounds for a busy computer."""
    (tree,) = axes(MACHINES / "printer.toml")
    wrong = replaced(tree, "controller.position", 1e9)
    list(problems(wrong))
    began = time.perf_counter()
    list(problems(wrong))
    assert time.perf_counter() - began < 0.5


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_macro_laws_of_two_stages(law: Any) -> None:
    """By (4.4): each gain up to its bound, whichever law is in force."""
    plain = Control()
    assert plain.unstable() == []
    for entry in entries(getattr(plain, law.field)):
        path, most = f"{law.field}.{entry.path}", entry.par.hi
        (found,) = replaced(plain, path, most).unstable()
        assert found[0] == path and "stable" in found[2]
        bound = float(found[2].split()[2])
        inside = bound - 0.01 * abs(bound)
        assert replaced(plain, path, inside).unstable() == []
        assert len(replaced(plain, path, bound + 0.03 * abs(bound)).unstable()) == 1


def test_what_takes_more_than_one_gain_is_refused_too() -> None:
    spoilt = Control()._replace(pd_tuned=Control().pd_tuned._replace(now=100.0, before=100.0))
    (found,) = spoilt.unstable()
    assert found[0].startswith("pd_tuned.") and "stable" in found[2]
    assert macro.problem(LAWS[0], getattr(Control(), LAWS[0].field)) is None


def test_a_file_with_such_gains_is_refused(tmp_path: Path) -> None:
    """Of the two-stage machine it may be meant for another bench than the nominal one."""
    file = tmp_path / "a.toml"
    file.write_text('machine = "axis"\n[controller]\nposition = "5000 1/s"\n')
    with pytest.raises(InputError, match=r"controller\.position.*at most"):
        serve_settings.load(file)
    file.write_text('[controller.pid]\nkp = "50 V/count"\n')
    loaded = serve_settings.load(file)
    assert isinstance(loaded, LiveSettings)
    refused = gains.unfit(loaded.controller)
    assert refused is not None and "pid.kp" in refused.reason and "at most" in refused.remedy
    assert isinstance(serve_settings.load(None), LiveSettings)


@pytest.mark.parametrize(
    ("file", "path", "value"),
    [
        ("printer", "position", 500.0),
        ("printer", "integral", 1e9),
        ("piezo-100um", "drift", 1e9),
        pytest.param("wire-250um", "ki", 9e8, marks=pytest.mark.slow),
        pytest.param("disc", "position", 1e5, marks=pytest.mark.slow),
    ],
)
def test_a_running_machine_refuses_them_too(file: str, path: str, value: float) -> None:
    bed = Bed(MACHINES / f"{file}.toml")
    reply = bed.ask(m.SetGains(((path, value),)))
    assert isinstance(reply, m.Refused) and path in reply.reason and "at most" in reply.remedy
    assert bed.machine.refusal(m.SetGains(((path, value),))) == reply


def test_a_running_machine_of_two_stages_refuses_them_too() -> None:
    reply = ready().ask(m.SetGains((("pid.kp", 50.0),)))
    assert isinstance(reply, m.Refused) and "pid.kp" in reply.reason and "at most" in reply.remedy
