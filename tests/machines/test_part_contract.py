"""What a part of another package must keep: the page's seal does, and each slip is told."""

from __future__ import annotations

from typing import Any

import pytest

from macromicro.kernel import kernel
from macromicro.machines import part_contract
from macromicro.plant.rubbing import Sheet
from tests.machines import own

SEAL = own.parts().seal
Seal = SEAL.settings


def test_the_part_of_the_page_keeps_everything() -> None:
    found = list(part_contract.check(SEAL))
    assert part_contract.broken(SEAL) == []
    said = {each.what: each.found for each in found}
    assert list(said) == [
        "shape", "settings", "force", "direction", "rest", "sheet", "compiled",
    ]  # fmt: skip
    assert said["shape"].startswith("settings level, rise") and "yes" in said["compiled"]
    assert "coulomb 4 N; it slides with 2 to 4.2" in said["sheet"]
    plain = {e.what: e for e in part_contract.check(SEAL._replace(force=_free, sheet=None))}
    assert "no: plain Python" in plain["compiled"].found and "none: say" in plain["sheet"].found


def test_what_slides_steadily_is_measured() -> None:
    p = Seal(level=4.0, rise=3.0, layer=1e-4, loss=0.0)
    _, force = part_contract.slid(SEAL, p, 0.01, 200)
    assert force == pytest.approx(4.0 * 0.01 / 0.0101 + 0.03, rel=1e-9)


def _free(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return 0.0, 0.0


def _one(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return 1.0


def _whole(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return 0, 1.0


def _down(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return 0.0, -1.0


def _forward(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return (-1.0 if v > 0.0 else 1.0), 0.0


def _kicks(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return (1e5 if v > 0.0 else -1e5), 0.0


def _listed(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return [s.heat]


def _numb(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return type(s)(float("nan"))


@kernel
def _odd(p: Any, s: Any, x: float, v: float, h: float) -> Any:
    return 0.0, float(str(1.0))


@pytest.mark.parametrize(
    ("changes", "what", "said"),
    [
        ({"settings": float}, "shape", "a NamedTuple of floats"),
        ({"settings": type("Low", (Seal,), {"__new__": lambda c: Seal(level=-1.0)})}, "settings",
         "level = -1 N"),
        ({"force": _one}, "force", "force gives"),
        ({"force": _whole}, "force", "force gives"),
        ({"force": _down}, "force", "d is -1: it would drive"),
        ({"after": _listed}, "force", "state"),
        ({"after": _numb}, "force", "state"),
        ({"force": _forward}, "direction", "it drives the axis"),
        ({"force": _kicks}, "rest", "is accelerated"),
        ({"sheet": lambda p: Sheet(40.0, 0.0, 0.0)}, "sheet", "coulomb 40 N, but it slides"),
        ({"sheet": lambda p: (1.0, 2.0)}, "sheet", "coulomb None"),
        ({"force": _odd, "sheet": None}, "compiled", "it does not compile"),
    ],
)  # fmt: skip
def test_a_slip_is_told(changes: dict[str, Any], what: str, said: str) -> None:
    found = part_contract.check(SEAL._replace(**changes), "mine")
    wrong = [each for each in found if not each.passed]
    assert wrong and wrong[0].what == what and said in wrong[0].found + wrong[0].remedy
    assert part_contract.broken(SEAL._replace(**changes))[0].startswith(f"{what}: ")
