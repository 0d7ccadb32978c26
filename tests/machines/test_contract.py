"""What a machine of another package must keep: the page's machine does, and each slip is told."""

from __future__ import annotations

from typing import Any

import pytest

from macromicro.kernel import kernel
from macromicro.machines import contract, machine
from macromicro.machines.signals import Sample
from macromicro.machines.tree import derive_all
from tests.machines import own

FLEXURE = own.module().flexure
KIND = FLEXURE.kind
_forward = KIND.advance


@pytest.mark.slow
def test_the_machine_of_the_page_keeps_everything() -> None:
    found = list(contract.check(FLEXURE))
    assert contract.broken(FLEXURE) == []
    assert [each.what for each in found] == [
        "shape", "settings", "kernels", "start", "direction", "compiled", "moves", "model",
    ]  # fmt: skip
    said = {each.what: each.found for each in found}
    assert "law, coil, blade, encoder" in said["shape"] and "all 4" in said["moves"]
    assert said["start"] == "at rest at 0 m, 2 states, 1 draws a period"


@pytest.mark.parametrize("shipped", machine.MACHINES, ids=lambda m: m.name)
def test_the_shipped_ones_do_before_they_are_compiled(shipped: Any) -> None:
    for look in ("_shape", "_settings", "_kernels", "_start", "_model"):
        assert getattr(contract, look)(shipped)


def _plain(p: Any, s: Any) -> Any:
    return KIND.show(p, s)


def _aside(p: Any, s: Any, t: float, noise: Any, k: int) -> Any:
    return Sample(t, 1e-3)


def _tuple(p: Any, s: Any, t: float, noise: Any, k: int) -> Any:
    return (t, 0.0)


def _list(p: Any, s: Any, effort: float, noise: Any, k: int, dt: float) -> Any:
    return [s.x, s.v]


calls = [0]


def _counting(p: Any, s: Any, effort: float, noise: Any, k: int, dt: float) -> Any:
    calls[0] += 1
    return type(s)(s.x + 1e-9 * calls[0], s.v)


def _backwards(p: Any, s: Any, effort: float, noise: Any, k: int, dt: float) -> Any:
    return _forward(p, s, -effort, noise, k, dt)


def _with(**parts: Any) -> Any:
    return FLEXURE._replace(kind=KIND._replace(**parts))


def _settings(**changes: str) -> Any:
    given = {path.replace("__", "."): value for path, value in changes.items()}
    return FLEXURE._replace(settings=FLEXURE.settings.with_(given))


SLOW = {"motion__velocity": "0.09 m/s", "guard__error": "0.02 mm"}
LOOKS = {
    "no machine": (lambda: KIND, "shape: a Kind"),
    "no set": (
        lambda: FLEXURE._replace(settings=FLEXURE.settings.blade),
        "shape: settings: Blade(",
    ),
    "another law's gains": (
        lambda: FLEXURE._replace(law=machine.MACHINES[2].law),
        "shape: controller is a Cascade; the law's gains, a StagePi",
    ),
    "a value beyond its bounds": (
        lambda: FLEXURE._replace(
            settings=FLEXURE.settings._replace(blade=FLEXURE.settings.blade._replace(mass=-1.0))
        ),
        "settings: default of blade.mass: -1 kg; above zero",
    ),
    "what cannot work together": (
        lambda: FLEXURE._replace(
            settings=derive_all(
                FLEXURE.settings._replace(blade=FLEXURE.settings.blade._replace(stiffness=40_000.0))
            )
        ),
        "settings: defaults, travel.high: 3 mm; at most 1.26 mm",
    ),
    "a rule that is not followed": (
        lambda: _settings(controller__velocity="9 V*s/m"),
        "settings: controller.velocity do not follow their rules",
    ),
    "plain Python": (lambda: _with(show=_plain), "kernels: show of the kind: plain Python"),
    "elsewhere": (lambda: _with(measure=kernel(_aside)), "start: 0.001 m at the start"),
    "no sample": (lambda: _with(measure=kernel(_tuple)), "start: measure gives (0.0, 0.0)"),
    "another state": (lambda: _with(advance=kernel(_list)), "start: advance gives a list; a State"),
    "impure": (
        lambda: _with(advance=kernel(_counting)),
        "start: the same start gave another state",
    ),
    "another truth": (lambda: _with(truth=Sample), "start: show gives another type; a Sample"),
    "backwards": (lambda: _with(advance=kernel(_backwards)), "direction: 5 V lead -"),
    "a guard that trips": (lambda: _settings(**SLOW), "moves: The stage does not follow"),
    "gains that are too weak": (
        lambda: _settings(arrival__tolerance="20 nm", arrival__patience="1 ms"),
        "moves: 0 of the 4 usual moves arrive; gains, or arrival.tolerance",
    ),
    "no response": (
        lambda: FLEXURE._replace(model=lambda tree, f: f[:1] * float("nan")),
        "model: model gives",
    ),
}


@pytest.mark.parametrize("slip", LOOKS)
def test_a_slip_is_told(slip: str) -> None:
    make, words = LOOKS[slip]
    found = contract.broken(make())
    assert any(line.startswith(words) for line in found), found


def test_without_a_model_nothing_is_asked_of_it() -> None:
    assert contract._model(FLEXURE._replace(model=None)) == "none: no `macromicro response`"
