"""The runner: what fails is lost alone, what is asked for is what comes."""

from __future__ import annotations

import sys

import pytest

from macromicro.drawing.exhibit import Exhibit, Grid, label
from macromicro.errors import InputError
from macromicro.thesis import all_procedures, choosing, reproduce
from macromicro.thesis.claims import NOT_MEASURED, REPRODUCED, Claim
from macromicro.thesis.procedure import Lab
from macromicro.thesis.reproduce import Chosen, Result

from . import broken_procedures as broken


def test_failures_lose_nothing_but_themselves() -> None:
    """One raises, one kills its process; the third's result and the order stay."""
    told: list[str] = []
    chosen = [Chosen(p) for p in (broken.DIES, broken.RAISES, broken.GOOD)]
    results = reproduce.run(
        chosen, Lab(seed=7), 2, lambda result, seconds: told.append(result.name)
    )
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


def test_without_matplotlib_tables_are_left(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = reproduce.run_one(broken.PICTURED, Lab())
    assert [e.number for e in drawn.exhibits] == ["Table 1.1", "1.2", "Table 1.3"]
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    plain = reproduce.run_one(broken.PICTURED, Lab())
    assert [e.number for e in plain.exhibits] == ["Table 1.1", "Table 1.3"]
    assert not plain.failure and not plain.notes


def test_a_figure_that_fails_loses_no_claim() -> None:
    """Nor another figure; each that is missing is noted."""
    chosen = [Chosen(p) for p in (broken.BREAKS, broken.UNFIT, broken.NO_DIAGRAM)]
    breaks, unfit, diagram = reproduce.run(chosen, Lab(seed=7), 1)
    for result in (breaks, unfit, diagram):
        assert not result.failure
        assert [c.verdict for c in result.claims] == [REPRODUCED]
        assert result.claims[0].measured == 7.0
    assert [e.number for e in breaks.exhibits] == ["Table 1.1", "Table 1.3"]
    assert breaks.notes == ("Figure 1.2 was not drawn: ValueError: no pencil",)
    assert "no pencil" in breaks.trace
    assert [e.number for e in unfit.exhibits] == ["Table 1.1", "Table 1.3"]
    assert len(unfit.notes) == 1
    assert unfit.notes[0].startswith("Figure 1.2 was not drawn: ")
    assert [e.number for e in diagram.exhibits] == ["Table 1.1", "4.3"]
    assert diagram.notes == ("Figure 9.9 was not drawn: KeyError: '9.9'",)


def test_a_claim_that_is_lost_keeps_its_words() -> None:
    laser = next(p for p in all_procedures() if p.name == "laser-noise")
    rows = reproduce.as_rows([reproduce.failure(laser, "interrupted")])
    assert [(r["id"], r["printed"], r["unit"]) for r in rows] == [
        ("I5", 2.0, "um"),
        ("I7", 2.0, "um"),
    ]
    assert [r["measured"] for r in rows] == [None, None]
    assert rows[0]["claim"] == "The laser's noise with the system at rest"
    assert all("interrupted" in r["reason"] for r in rows)


def test_rows_come_in_the_order_of_the_list() -> None:
    procedures = {p.name: p for p in all_procedures()}
    results = [
        reproduce.failure(procedures[n], "") for n in ("cycle-testing", "technologies", "kiln")
    ]
    ids = [r["id"] for r in reproduce.as_rows(results)]
    assert ids == ["D9", "D10", "S1", "S2", "S6", *(f"A{k}" for k in range(1, 7))]


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
    by_claim = reproduce.narrow(Chosen(broken.GOOD, frozenset({"X2"}), frozenset()), result)
    by_figure = reproduce.narrow(Chosen(broken.GOOD, frozenset(), frozenset({"1.1"})), result)
    assert [c.id for c in by_claim.claims] == ["X2"]
    assert [e.number for e in by_claim.exhibits] == ["1.2"]
    assert [c.id for c in by_figure.claims] == ["X1"]
    assert [e.number for e in by_figure.exhibits] == ["1.1"]
    assert reproduce.narrow(Chosen(broken.GOOD), result) == result


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
        ("Appendix D", ["kiln", "cycle-testing"]),
        ("appendix d", ["kiln", "cycle-testing"]),
        ("Appendix A", ["actuator-principle"]),
        ("Appendix C", ["channels"]),
        ("4.1.1", ["macro-identification"]),
        ("5.1", ["electrothermal"]),
        ("(2.1)", ["actuator-principle"]),
        ("Equation (2.1)", ["actuator-principle"]),
        ("eq. 2.1", ["actuator-principle"]),
    ],
)
def test_names_that_only_takes(name: str, procedures: list[str]) -> None:
    chosen = choosing.choose([name], all_procedures())
    assert [c.procedure.name for c in chosen] == procedures


def test_every_label_of_the_page_is_a_name() -> None:
    """A figure, a table, an equation: what stands over it can be asked for."""
    for procedure in all_procedures():
        for number in (*procedure.figures, *procedure.diagrams):
            (chosen,) = choosing.choose([label(number)], all_procedures())
            assert chosen.procedure == procedure
            assert chosen.figures == {number}


def test_appendix_d_is_all_of_its_figures() -> None:
    chosen = choosing.choose(["Appendix D"], all_procedures())
    numbers = {n for c in chosen for n in c.procedure.figures if n.startswith("D.")}
    assert numbers == {f"D.{k}" for k in (5, 6, 7, *range(9, 15))}
    assert all(c.figures is None for c in chosen)


def test_a_chapter_is_all_of_its_sections() -> None:
    chosen = {c.procedure.name for c in choosing.choose(["4"], all_procedures())}
    assert {"macro-friction", "macro-identification", "macro-control"} <= chosen
    assert "laser-noise" not in chosen


@pytest.mark.parametrize(
    "name",
    [
        "Z9",
        "",
        "Figure 9.9",
        "Equation (9.9)",
        "(9.9)",
        "Appendix Z",
        "D",
        "4.99",
        "Table 9",
        "../etc",
    ],
)
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
