"""Laboratory procedures by name, the package's and a user's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.recorded import columns_named
from macromicro.recording import Recording
from macromicro.thesis import collecting

MADE = Recording.from_arrays(
    columns_named("t", "motor"), [np.arange(3) * 1e-3, np.zeros(3)], 1e-3, {}
)
own = collecting.Procedure("own", lambda lab: {"own": MADE}, ("encoder",), "nothing", "a record")
other = "no procedure"


def test_a_procedure_of_ones_own_is_found_by_its_module() -> None:
    assert collecting.find("tests.thesis.test_collecting:own") is own
    assert own.then == "" and own.megabytes == 50
    assert [collecting.find(p.name) for p in collecting.PROCEDURES] == list(collecting.PROCEDURES)


def test_an_entry_point_names_one(monkeypatch: pytest.MonkeyPatch) -> None:
    place = {"lab-own": "tests.thesis.test_collecting:own"}
    monkeypatch.setattr(
        collecting.plugins, "entry_points", lambda group: place if group == collecting.GROUP else {}
    )
    assert collecting.find("lab-own") is own
    with pytest.raises(InputError, match="hall, lab-own; or MODULE:PROCEDURE"):
        collecting.find("lab")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("tests.thesis.test_collecting:other", "other, str'; accepted: a macromicro.thesis"),
        ("tests.thesis.test_collecting:owm", "such as own"),
        ("dead", "one of dead-zone, macro-steps"),
    ],
)
def test_what_is_none_is_refused(name: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        collecting.find(name)
    assert words in str(refused.value)


@pytest.mark.parametrize(
    "found",
    [None, {}, [MADE], {"a/b": MADE}, {"..": MADE}, {"": MADE}, {1: MADE}, {"a": np.zeros(3)}],
)
def test_what_is_no_recordings_is_not_saved(found: Any) -> None:
    with pytest.raises(InputError, match=r"procedure own: .*one recording or more"):
        collecting.check(found, "own")
    assert collecting.check({"a": MADE}, "own") == {"a": MADE}


def test_runs_stand_below_each_other_without_the_truth() -> None:
    columns = columns_named("t", "motor", "true_micro")
    one = Recording.from_arrays(columns, [np.arange(3.0), np.ones(3), np.ones(3)], 1.0, {})
    both = collecting.join([one, one], {"seed": 3})
    assert [c.name for c in both.columns] == ["t", "motor", "run"]
    assert both["run"].tolist() == [1, 1, 1, 2, 2, 2] and both.attributes["seed"] == 3
    assert collecting.join([one]).attributes == {}
