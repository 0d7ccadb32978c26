"""The runner: what fails is lost alone, what is asked for is what comes."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # spawned processes get the path, too

import broken_procedures as broken

from macromicro.drawing.exhibit import Exhibit, Grid
from macromicro.errors import InputError
from macromicro.experiments import choosing, reproduce
from macromicro.experiments.claim import NOT_MEASURED, REPRODUCED, Claim
from macromicro.experiments.procedure import Lab
from macromicro.experiments.procedures import all_procedures
from macromicro.experiments.reproduce import Chosen, Result


def test_failures_lose_nothing_but_themselves() -> None:
    """One raises, one kills its process; the third's result and the order stay."""
    told: list[str] = []
    chosen = [Chosen(p) for p in (broken.DIES, broken.RAISES, broken.GOOD)]
    results = reproduce.run(chosen, Lab(seed=7), 2, lambda name, seconds: told.append(name))
    dies, raises, good = results
    assert [r.name for r in results] == ["dies", "raises", "good"]
    assert sorted(told) == ["dies", "good", "raises"]
    assert dies.failure == "its process died"
    assert raises.failure == "ValueError: the wire broke"
    assert "the wire broke" in raises.trace
    assert good.claims[0].measured == 7.0
    assert good.exhibits[0].data == Grid(("seed",), [("7",)])
    for lost in (dies, raises):
        assert [c.verdict for c in lost.claims] == [NOT_MEASURED]
        assert "failed" in lost.claims[0].reason


def test_stopped_early_reports_the_rest_as_interrupted() -> None:
    results = reproduce.run([Chosen(broken.GOOD)], Lab(), 1, None, lambda: True)
    assert results[0].failure == "interrupted"


def test_narrowed_to_a_claim_or_a_figure() -> None:
    claims = [Claim(n, "1", n, 1.0, 1.0, "", REPRODUCED) for n in ("X1", "X2")]
    exhibits = [
        Exhibit("1.1", "a", "a", ("X1",), "table", Grid((), [])),
        Exhibit("1.2", "b", "b", ("X2",), "table", Grid((), [])),
    ]
    result = Result("good", claims, exhibits, 1.0)
    by_claim = reproduce.narrowed(Chosen(broken.GOOD, frozenset({"X2"}), frozenset()), result)
    by_figure = reproduce.narrowed(Chosen(broken.GOOD, frozenset(), frozenset({"1.1"})), result)
    assert [c.id for c in by_claim.claims] == ["X2"]
    assert [e.number for e in by_claim.exhibits] == ["1.2"]
    assert [c.id for c in by_figure.claims] == ["X1"]
    assert [e.number for e in by_figure.exhibits] == ["1.1"]
    assert reproduce.narrowed(Chosen(broken.GOOD), result) == result


@pytest.mark.parametrize(
    ("name", "procedures"),
    [
        ("I5", ["laser-noise"]),
        ("i5", ["laser-noise"]),
        ("laser-noise", ["laser-noise"]),
        ("Figure 6.6", ["laser-noise"]),
        ("fig. 6.6", ["laser-noise"]),
        ("6.4.1", ["laser-noise"]),
        ("Section 6.4.1", ["laser-noise"]),
        ("Appendix D", ["cycle-testing"]),
        ("appendix d", ["cycle-testing"]),
    ],
)
def test_names_that_only_takes(name: str, procedures: list[str]) -> None:
    chosen = choosing.choose([name], all_procedures())
    assert [c.procedure.name for c in chosen] == procedures


def test_a_chapter_is_all_of_its_sections() -> None:
    chosen = {c.procedure.name for c in choosing.choose(["4"], all_procedures())}
    assert {"macro-friction", "macro-identification", "macro-control"} <= chosen
    assert "laser-noise" not in chosen


@pytest.mark.parametrize("name", ["Z9", "", "Figure 9.9", "4.99", "Table 9", "../etc"])
def test_unknown_names_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="--only"):
        choosing.choose([name], all_procedures())


def test_several_names_join() -> None:
    chosen = choosing.choose(["I5", "I7", "Figure 6.6"], all_procedures())
    assert len(chosen) == 1
    assert chosen[0].ids == {"I5", "I7"}
    assert chosen[0].figures == {"6.6"}
    whole = choosing.choose(["I5", "laser-noise"], all_procedures())
    assert whole[0].ids is None
