"""What Python and C mean by the same words, and what is no word of the language."""

from __future__ import annotations

import inspect
import math
from copy import deepcopy
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.export import files, kinds
from macromicro.export.units import Entry, Unit
from tests.export import spoken
from tests.export.bound import Bound, arrays, bits, built

BUILT = TemporaryDirectory(prefix="macromicro-")  # gone with this process
NUMBERS = st.one_of(
    st.floats(-1e6, 1e6),
    st.sampled_from([0.0, -0.0, 0.5, 1.5, 2.5, -0.5, -1.5, 1e18, math.nan, math.inf, -math.inf]),
)
WHOLE = st.integers(-40, 40)
WORDS = {
    "divided": (NUMBERS, NUMBERS),
    "shared": (WHOLE, WHOLE),
    "rounded": (NUMBERS,),
    "ranked": (NUMBERS, NUMBERS, NUMBERS),
    "ordered": (NUMBERS, NUMBERS, NUMBERS),
    "powered": (NUMBERS, st.floats(-3.0, 3.0)),
    "signs": (NUMBERS, NUMBERS),
    "whole_steps": (NUMBERS, st.integers(0, 12)),
    "shrinking": (st.integers(0, 12),),
    "swapped": (NUMBERS, NUMBERS),
    "branched": (NUMBERS, st.builds(spoken.Pair, NUMBERS, NUMBERS)),
    "either": (NUMBERS, st.builds(spoken.Pair, NUMBERS, NUMBERS)),
    "started": (NUMBERS,),
    "of_another": (NUMBERS,),
    "summed_pair": (st.builds(spoken.Pair, NUMBERS, NUMBERS),),
    "summed": (st.just(spoken.ROWS), NUMBERS),
}
EXAMPLES = {
    "shared": (1, 2), "whole_steps": (0.0, 1), "branched": (0.0, spoken.Pair(0.0)),
    "shrinking": (1,), "either": (0.0, spoken.Pair(0.0)),
    "summed_pair": (spoken.Pair(0.0),), "summed": (spoken.ROWS, 0.0),
}  # fmt: skip


@cache
def made(name: str) -> Any:
    function = getattr(spoken, name)
    values = EXAMPLES.get(name, (0.0,) * function.__code__.co_argcount)
    unit = Unit(name, name, (Entry("go", function, values),), {})
    written = files.write_unit(unit)
    return written, built(written, Path(mkdtemp(dir=BUILT.name)), level="-O2")


@pytest.mark.parametrize("name", WORDS)
def test_words_mean_the_same(name: str) -> None:
    written, library = made(name)
    bound, function = Bound(written.program), getattr(spoken, name)
    names = list(written.entries[0].parameters)

    @settings(max_examples=120, deadline=None, derandomize=True, database=None)
    @given(st.tuples(*WORDS[name]))
    def same(values: tuple[Any, ...]) -> None:
        mine, theirs = deepcopy(values), deepcopy(values)
        try:
            expected = function(*mine)
        except (ZeroDivisionError, OverflowError, ValueError):
            assume(False)
        assume(name != "rounded" or abs(expected[0]) < 2**62)
        found = bound.call(library, written.entries[0], dict(zip(names, theirs, strict=True)))
        assert bits(found) == bits(expected)
        assert [a.tobytes() for a in arrays(theirs)] == [a.tobytes() for a in arrays(mine)]

    same()


def test_each_line_of_python_is_a_comment_above_its_c() -> None:
    written, _ = made("branched")
    source = inspect.getsource(spoken.branched).partition("\n")[2]
    lines = [line.strip() for line in written.code.splitlines()]
    comments = [line.lstrip("/ ") for line in lines if line.startswith("//")]
    assert comments == [line.strip() for line in source.splitlines()]


def test_what_is_beyond_the_integers_ends_at_them() -> None:
    written, library = made("rounded")
    bound = Bound(written.program)
    shown = [
        bound.call(library, written.entries[0], {"x": x})[2]
        for x in (1e30, -1e30, math.nan, math.inf, 2.0**63, -(2.0**63))
    ]
    top, low = 2**63 - 1, -(2**63)
    assert shown == [top, low, 0, top, top, low]


@given(st.integers(0, 3))
@example(2)
@settings(deadline=None, max_examples=4)
def test_a_helper_stands_for_a_division_that_python_refuses(number: int) -> None:
    """Whole numbers by 0: 0, where C's own division would end the program."""
    written, library = made("shared")
    found = Bound(written.program).call(library, written.entries[0], {"i": number, "j": 0})
    assert found[:2] == (0, 0)


REFUSED = {
    "by_text": ("'one'", "x == 'one'"),
    "by_numpy": ("np.sin", "a kernel"),
    "by_list": ("[x, x]", "language of kernels"),
    "by_other": ("plain", "a kernel (under @kernel)"),
    "by_error": ("try:", "language of kernels"),
    "by_hypot": ("math.hypot", "of math:"),
    "by_itself": ("calls itself", "a loop"),
    "by_both": ("y, float and Pair", "one type"),
    "by_index": ("x, float", "a whole number"),
    "by_items": ("for over s.values", "range"),
    "by_turns": ("divided", "a statement of its own"),
    "by_order": ("summed", "alone in its statement"),
    "by_word": ("x, float", "a truth value"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_words_are_refused_with_file_and_line(name: str) -> None:
    function = getattr(spoken, name)
    values = tuple(
        spoken.ROWS if n == "s" else 0.0 for n in function.__code__.co_varnames[
            : function.__code__.co_argcount]
    )  # fmt: skip
    unit = Unit(name, name, (Entry("go", function, values),), {})
    with pytest.raises(InputError) as told:
        files.write_unit(unit)
    first = function.__code__.co_firstlineno
    place, _, line = told.value.where.partition(",")[0].rpartition(":")
    assert Path(place).name == "spoken.py"
    assert first < int(line) < first + 8
    assert any(word in str(told.value) for word in REFUSED[name])


@pytest.mark.parametrize("value", ["text", None, [1.0], np.array(["a"])])
def test_values_that_have_no_type(value: Any) -> None:
    with pytest.raises(kinds.Unlike):
        kinds.of_value(value)
