"""Rounds of a campaign: what the judge of positions complains of, and which trials a kind has."""

from __future__ import annotations

import math
import random
import time
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import faulty
from faultmatrix.bounds import Bounds
from macromicro.serve import faults
from soak.campaign import Campaign, Order
from soak.trials import AROUND, NO_FAULT, TWO_STAGE, Trial, trials


class Client:
    """Answers queries as prepared."""

    def __init__(self, answers: dict[str, str]) -> None:
        self.answers = answers
        self.sent: list[str] = []

    def ask(self, query: str) -> str:
        return self.answers.get(query, "0")

    def send(self, text: str) -> None:
        self.sent.append(text)


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> Campaign:
    """A campaign without a server; the machine stands at 10 mm, trusted within 0.1 mm."""
    monkeypatch.setattr(time, "sleep", lambda seconds: None)
    it = Campaign.__new__(Campaign)
    cells = np.zeros(faulty.CELLS)
    cells[faulty.STAGE] = 0.010
    it.victim = SimpleNamespace(cells=cells)  # type: ignore[assignment]
    it.rng, it.complaints, it.outcomes = random.Random(1), [], Counter()
    it.checked = it.homings = it.busy = it._last = 0
    answers = {"POS?": "10,0.05,1", "FAUL?": '0,"","","",""', "MODE?": '"ready"', "MOVE:NUMB?": "0"}
    it._client = Client(answers)  # type: ignore[assignment]
    it._bounds = Bounds(5e-5, 1.0, (5.0,), 1e-3, arrival=1e-4)
    it.scale, it.unit, it._frame, it._searches, it._error = 1e3, "MM", 0.0, False, ""
    it._stopped = it._start = 0.0
    it._there = 0.010
    it._expected, it._claimed, it._trial = [], False, NO_FAULT
    it.unseen = []
    return it


def answers(made: Campaign, **more: str) -> None:
    client: Any = made._client
    client.answers |= {f"{name}?": text for name, text in more.items()}


def look(made: Campaign, name: str, text: str, outcome: str, place: float = math.nan) -> None:
    """After an order that was left alone where it has a place to go to."""
    made._trial = NO_FAULT if name == faulty.NONE else Trial(name)
    made._look(Order(text, place), outcome, alone=math.isfinite(place))


def test_a_right_position_is_no_complaint(made: Campaign) -> None:
    look(made, "none", "MOVE 10 MM", "done", 0.010)
    assert made.complaints == []
    assert made.checked == 1


def test_a_wrong_position_that_is_trusted_is_one(made: Campaign) -> None:
    answers(made, POS="10.2,0.05,1")
    look(made, "encoder-jump", "MOVE 10 MM", "fault")
    assert "trusted, and 0.2 MM off" in made.complaints[0]


def test_an_encoder_that_dies_as_the_stage_comes_to_rest_is_counted_apart(made: Campaign) -> None:
    answers(made, POS="17,0.05,1")
    look(made, "encoder-frozen", "MOVE 10 MM", "stopped")
    assert made.complaints == [] and made.unseen == [pytest.approx(0.007)]


@pytest.mark.parametrize(
    ("place", "name", "fault"),
    [
        (120.0, "encoder-frozen", "0"),
        (17.0, "encoder-jump", "0"),
        (17.0, "encoder-frozen", "207"),
    ],
)
def test_it_is_not_where_it_could_be_seen(
    made: Campaign, place: float, name: str, fault: str
) -> None:
    """Farther than a stage gets, of a sensor that did not die, or behind a fault."""
    answers(made, POS=f"{place},0.05,1", FAUL=f'{fault},"stuck","It stands.","",""')
    look(made, name, "MOVE 10 MM", "stopped")
    assert len(made.complaints) == 1 and not made.unseen


def test_a_wrong_position_that_is_not_trusted_is_none(made: Campaign) -> None:
    answers(made, POS="17,0.05,0")
    look(made, "encoder-jump", "MOVE 10 MM", "fault")
    assert made.complaints == []


def test_done_is_where_it_was_to_be(made: Campaign) -> None:
    look(made, "none", "MOVE 11 MM", "done", 0.011)
    assert "not there" in made.complaints[0]


@pytest.mark.parametrize(("shown", "complaints"), [("1204", 0), ("1207", 1)])
def test_a_stage_is_where_it_was_to_be(made: Campaign, shown: str, complaints: int) -> None:
    answers(made, **{"STAG1:POS": f"{shown},0,1"})
    order = Order("MOVE:MACR 1200", math.nan, "STAG1:POS?", 1200.0, 6.0)
    made._look(order, "done", alone=True)
    assert len(made.complaints) == complaints


def test_outputs_are_off_while_it_is_disabled(made: Campaign) -> None:
    made.victim.cells[faulty.MOTOR] = 1.0
    answers(made, MODE='"fault"')
    look(made, "motor-dead", "HOME", "fault")
    assert "outputs are on" in made.complaints[0]


def test_a_fault_without_one_injected_is_not_explained(made: Campaign) -> None:
    answers(made, FAUL='206,"following error","The stage does not follow.","",""')
    look(made, "none", "MOVE 10 MM", "fault")
    assert all("does not follow" in each for each in made.complaints)
    assert len(made.complaints) == 2  # no trial explains the fault, and nothing the end


def test_a_fault_is_seen_once_and_explained_by_its_trial(made: Campaign) -> None:
    answers(made, FAUL='11,"jump","It jumped.","",""')
    made._trial = Trial("encoder-jump", codes=(11,))
    assert made._latched() == made._latched() == (11, "It jumped.")
    assert made._expected == [11] and made.complaints == []
    made._claimed, made._trial = False, Trial("laser-lost", codes=())
    made._latched()
    assert made.complaints == ["fault 11 (It jumped.) with laser-lost"]


def test_a_busy_computer_explains_missed_periods(made: Campaign) -> None:
    answers(made, FAUL=f'{faults.LATE},"late","Late.","",""')
    made._latched()
    assert (made.busy, made.complaints) == (1, [])


def test_a_kind_has_the_faults_of_its_rig_and_what_happens_around_it() -> None:
    subject: Any = SimpleNamespace(led=True, faults=lambda: ("encoder-jump", "slow"))
    assert trials(subject) == (Trial("encoder-jump"), *AROUND)
    assert trials(SimpleNamespace(led=False)) == (*TWO_STAGE, *AROUND)  # type: ignore[arg-type]
    assert all(each.name in faulty.FAULTS for each in TWO_STAGE)
