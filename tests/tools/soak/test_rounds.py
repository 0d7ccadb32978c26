"""The rounds of a machine of one stage: what the judge of positions complains of."""

from __future__ import annotations

import random
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import faulty
from faultmatrix.bounds import Bounds
from soak import rounds as parts
from soak import table
from soak.rounds import Round, Rounds


class Client:
    """Answers queries as told."""

    def __init__(self, answers: dict[str, str]) -> None:
        self.answers, self.sent = answers, []

    def ask(self, query: str) -> str:
        return self.answers.get(query, "0")

    def send(self, text: str) -> None:
        self.sent.append(text)


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Rounds:
    """Rounds that stand at 10 mm, trusted within 0.1 mm, without a server."""
    monkeypatch.setattr(parts.time, "sleep", lambda seconds: None)
    it = Rounds.__new__(Rounds)
    cells = np.zeros(faulty.CELLS)
    cells[faulty.STAGE] = 0.010
    it.victim = SimpleNamespace(cells=cells, subject=SimpleNamespace(name="slide"))  # type: ignore[assignment]
    it.rng, it.complaints, it.rounds, it.outcomes = random.Random(1), [], [], Counter()
    it.checked = it.homings = it.busy = it.rows = it._last = 0
    answers = {"POS?": "10,0.05,1", "FAUL?": '0,"","","",""', "MODE?": '"ready"', "MOVE:NUMB?": "0"}
    it._client = Client(answers)  # type: ignore[assignment]
    it._bounds = Bounds(5e-5, 1.0, (5.0,), 1e-3, arrival=1e-4)
    it.scale, it.unit, it._frame, it._searches, it._error = 1e3, "MM", 0.0, False, ""
    it._stopped = it._start = 0.0
    it._there = 0.010
    it.unseen = []
    return it


def answers(made: Rounds, **more: str) -> None:
    client: Any = made._client
    client.answers |= {f"{name}?": text for name, text in more.items()}


def test_a_right_position_is_no_complaint(made: Rounds) -> None:
    made._look("none", "MOVE 10 MM", "done", "MOVE 10 MM", 0.010)
    assert made.complaints == []
    assert made.checked == 1


def test_a_wrong_position_that_is_trusted_is_one(made: Rounds) -> None:
    answers(made, POS="10.2,0.05,1")
    made._look("encoder-jump", "MOVE 10 MM", "fault", "", np.nan)
    assert "trusted, and 0.2 MM off" in made.complaints[0]


def test_an_encoder_that_dies_as_the_stage_comes_to_rest_is_counted_apart(made: Rounds) -> None:
    answers(made, POS="17,0.05,1")
    made._look("encoder-frozen", "MOVE 10 MM", "stopped", "", np.nan)
    assert made.complaints == [] and made.unseen == [pytest.approx(0.007)]
    assert "1 times, at most 7 mm off" in table.of_kind(made, [])


@pytest.mark.parametrize(
    ("place", "name", "fault"),
    [
        (120.0, "encoder-frozen", "0"),
        (17.0, "encoder-jump", "0"),
        (17.0, "encoder-frozen", "207"),
    ],
)
def test_it_is_not_where_it_could_be_seen(
    made: Rounds, place: float, name: str, fault: str
) -> None:
    """Farther than a stage gets, of a sensor that did not die, or behind a fault."""
    answers(made, POS=f"{place},0.05,1", FAUL=f'{fault},"stuck","It stands.","",""')
    made._look(name, "MOVE 10 MM", "stopped", "", np.nan)
    assert len(made.complaints) == 1 and not made.unseen


def test_a_wrong_position_that_is_not_trusted_is_none(made: Rounds) -> None:
    answers(made, POS="17,0.05,0")
    made._look("encoder-jump", "MOVE 10 MM", "fault", "", np.nan)
    assert made.complaints == []


def test_done_is_where_it_was_to_be(made: Rounds) -> None:
    made._look("none", "MOVE 11 MM", "done", "MOVE 11 MM", 0.011)
    assert "not there" in made.complaints[0]


def test_outputs_are_off_while_it_is_disabled(made: Rounds) -> None:
    made.victim.cells[faulty.MOTOR] = 1.0
    answers(made, MODE='"fault"')
    made._look("motor-dead", "HOME", "fault", "", np.nan)
    assert "outputs are on" in made.complaints[0]


def test_a_fault_without_one_injected_is_not_explained(made: Rounds) -> None:
    answers(made, FAUL='206,"following error","The stage does not follow.","",""')
    made._look("none", "MOVE 10 MM", "fault", "", np.nan)
    assert "does not follow" in made.complaints[0]


def test_a_jog_at_its_limit_may_be_refused(made: Rounds) -> None:
    made._error = '-221,"Settings conflict;the macro-stage is at its soft limit"'
    made._look("none", "JOG:MACR 1 MM/S", "refused", "", np.nan)
    assert made.complaints == []


def test_the_part_of_the_table(made: Rounds) -> None:
    made.rounds = [
        Round("motor-dead", "MOVE", 207, "The stage is pushed and stands.", "fault"),
        Round("motor-dead", "HOME", 0, "", "stalled"),
    ]
    text = table.of_kind(made, ["a complaint"])
    assert text.startswith("**Slide**")
    assert "| 2 | 1 | 1 fault, 1 stalled | The stage is pushed and stands. |" in text
    assert "- **unexplained**: a complaint" in text
