"""Settings by path: values with units, what follows from them, errors as of a settings file."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from macromicro import Settings, load_settings
from macromicro.errors import InputError
from macromicro.schema.par import entries

NOMINAL = Settings()


def test_a_changed_copy_is_what_a_file_gives(tmp_path: Path) -> None:
    """The same values, and the same that follows: a longer screw has a longer travel."""
    place = tmp_path / "long.toml"
    place.write_text(
        '[bench]\ncarriage.stop_high = "410 mm"\nfriction.coulomb = "11 N"\n'
        '[controller]\nmacro_law = "pid"\n'
    )
    changes = {
        "bench.carriage.stop_high": "410 mm",
        "bench.friction.coulomb": "11 N",
        "controller.macro_law": "pid",
    }
    found = NOMINAL.with_(changes)
    assert found == load_settings(place) != NOMINAL
    assert found.bench.friction.coulomb == 11.0
    assert found.travel.macro > NOMINAL.travel.macro
    assert Settings() == NOMINAL


def test_one_at_a_time_and_in_tables() -> None:
    one = NOMINAL.with_("bench.friction.coulomb", "11 N").with_("controller.macro_law", "pid")
    nested = {"bench": {"friction": {"coulomb": "0.011 kN"}}, "controller.macro_law": "pid"}
    assert one == NOMINAL.with_(nested)
    assert type(one) is Settings and NOMINAL.with_({}) == NOMINAL


@pytest.mark.parametrize("value", [np.float64(0.25), 0.25, "0.25", "25 %"])
def test_plain_numbers_where_there_is_no_unit(value: object) -> None:
    """Of numpy, too."""
    path = "bench.belt.participation"
    assert NOMINAL.with_(path, value)[path] == 0.25


def test_lists_come_as_tuples_and_arrays_too() -> None:
    entry = next(e for e in entries(NOMINAL) if isinstance(e.value, tuple))
    texts = tuple(f"{x!r} {entry.par.unit}" for x in entry.value)
    assert NOMINAL.with_(entry.path, texts) == NOMINAL
    assert NOMINAL.with_(entry.path, np.array(texts)) == NOMINAL


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("bench.friction.colomb", "11 N"), r"colomb: unknown key.*bench\.friction\.coulomb"),
        (("bench.friction.coulomb", "11 V"), r"bench\.friction\.coulomb: '11 V'; accepted: .*N"),
        (("bench.friction.coulomb", 11), r"coulomb: '11'; accepted: .*unit"),
        (("bench.friction.coulomb", "-1 N"), r"coulomb: '-1 N'; accepted: 0 N or more"),
        (("bench.friction.coulomb", True), r"coulomb: 'True'"),
        (("bench.friction.coulomb",), "coulomb: no value"),
        (("bench.friction", "11 N"), r"a table \[bench.friction\] with coulomb"),
        (("controller.macro_law", "pidd"), "'pidd'; accepted: 'pid' or"),
        (("bench.wire.stop", "5 mm"), r"bench\.wire\.stop.*below bench\.wire\.stroke"),
        (({"bench.friction.coulomb": "11 N"}, "12 N"), "a value beside a mapping"),
        ((3,), "'3'; accepted: a path and its value"),
    ],
)
def test_what_is_not_accepted(given: tuple[Any, ...], words: str) -> None:
    """Path, value and what is accepted, as of a settings file."""
    with pytest.raises(InputError, match=words) as caught:
        NOMINAL.with_(*given)
    assert str(caught.value).startswith("settings")


def test_a_value_by_its_path() -> None:
    """Stored units: 9.5 mm is 0.0095. A place is that of any tuple."""
    assert NOMINAL["bench.friction.coulomb"] == NOMINAL.bench.friction.coulomb
    assert NOMINAL["bench.friction"] is NOMINAL.bench.friction
    assert NOMINAL.with_("bench.carriage.stop_high", "300 mm")["bench.carriage.stop_high"] == 0.3
    assert NOMINAL[0] is NOMINAL.bench and NOMINAL[4] is NOMINAL.travel
    assert NOMINAL[:2] == (NOMINAL.bench, NOMINAL.sensors)
    for wrong in ("bench.friction.colomb", "bench.frction", "coulomb", "", "bench."):
        with pytest.raises(InputError, match="unknown key"):
            NOMINAL[wrong]
    with pytest.raises(InputError, match=r"such as bench\.friction\.coulomb"):
        NOMINAL["bench.friction.colomb"]


def test_shown_is_what_differs() -> None:
    assert repr(NOMINAL) == "<Settings: the defaults>"
    found = repr(NOMINAL.with_({"bench.friction.coulomb": "11 N", "controller.macro_law": "pid"}))
    assert "bench.friction.coulomb = 11 N (default 10.485 N)" in found
    assert "controller.macro_law = pid (default pd-tuned)" in found and "\n" not in found


def test_shown_is_short() -> None:
    """However many differ."""
    numbers = [e for e in entries(NOMINAL.bench.friction) if e.number and e.value]
    many = {f"bench.friction.{e.path}": f"{e.value * 1.01!r} {e.par.unit}" for e in numbers}
    found = repr(NOMINAL.with_(many))
    assert len(many) > 8 and found.endswith(f"{len(many) - 8} more>")


def test_copies_and_pickles_are_equal() -> None:
    """As of any tuple: sweeps send settings to other processes."""
    changed = NOMINAL.with_("bench.friction.coulomb", "11 N")
    for other in (copy.deepcopy(changed), pickle.loads(pickle.dumps(changed))):
        assert other == changed and type(other) is Settings
