"""Motion programmes: what the files mean, and one clear sentence for each wrong one."""

import math
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from macromicro.errors import InputError
from macromicro.programme import (
    MACRO,
    MAX_MOVES,
    MICRO,
    Limits,
    Programme,
    find,
    load,
    shipped,
)
from macromicro.programme.scheduled import with_corrections

LIMITS = Limits(0.0, 2800.0, 0.0, 3.8e-3, 14_000.0)


def read(folder: Path, text: str | bytes, suffix: str = ".toml") -> Programme:
    file = folder / f"wave{suffix}"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    return load(file, LIMITS)


def refused(folder: Path, text: str | bytes, suffix: str = ".toml") -> str:
    with pytest.raises(InputError) as caught:
        read(folder, text, suffix)
    message = str(caught.value)
    assert message.startswith(str(folder / f"wave{suffix}"))
    assert "\n" not in message
    assert len(message) < 600
    return message.removeprefix(str(folder))


def test_thesis_is_the_integrated_test_of_chapter_6() -> None:
    """Chapter 6, Figure 6.2: a decaying square wave, and a sequential step after each move."""
    thesis = load(shipped()["thesis"], LIMITS)
    assert len(thesis.target) == 8 * 5
    assert thesis.stage.reshape(8, 5).tolist() == [[MACRO, *[MICRO] * 4]] * 8
    table = thesis.target.reshape(8, 5)
    assert (table[:, 0] / 14).tolist() == [190, 10, 170, 30, 150, 50, 130, 100]
    assert table[:, 1:].tolist() == [[1.5e-3, 3e-3, 1.5e-3, 0.3e-3]] * 8
    assert thesis.hold.reshape(8, 5).tolist() == [[0.0, 2.0, 2.0, 2.0, 2.0]] * 8
    assert np.isnan(thesis.start).all()
    assert not thesis.scheduled
    assert thesis.title == "Integrated test (Chapter 6)"


def test_full_travel_goes_both_ways() -> None:
    travel = load(shipped()["full-travel"], LIMITS)
    assert set(travel.stage) == {MACRO}
    assert travel.target.tolist() == [2800, 0, 1400, 2800, 1400, 0]


def test_staircase_is_scheduled() -> None:
    stairs = load(shipped()["staircase"], LIMITS)
    assert stairs.scheduled
    assert stairs.stage.tolist() == [MACRO] + [MICRO] * 15
    assert stairs.start.tolist() == [0, 0, *range(4, 32, 2)]
    assert stairs.hold.tolist() == [4.0, 4.0] + [2.0] * 14
    assert stairs.end == 32
    up = [0.5e-3 * k for k in range(1, 8)]
    up_and_down = [0.3e-3, *up, *up[-2::-1], 0.3e-3]
    assert np.allclose(stairs.target[1:], up_and_down, rtol=1e-15)


def test_find_knows_names_and_paths(tmp_path: Path) -> None:
    assert list(shipped()) == ["fast", "full-travel", "staircase", "thesis"]
    assert find("thesis") == shipped()["thesis"]
    (tmp_path / "mine.csv").touch()
    assert find(str(tmp_path / "mine.csv")) == tmp_path / "mine.csv"
    for missing in ("thesys", "", "a\0b", "x" * 5000):
        with pytest.raises(InputError, match="fast, full-travel, staircase, thesis"):
            find(missing)
    with pytest.raises(InputError, match="nearest: thesis"):
        find("thesys")


def test_single_moves(tmp_path: Path) -> None:
    text = """
    [[moves]]
    macro = "120 mm"
    hold = "500 ms"
    [[moves]]
    micro = "1500 um"
    hold = "1 h"
    [[moves]]
    macro = "1679.6 counts"
    hold = "2 s"
    """
    programme = read(tmp_path, text)
    assert programme.stage.tolist() == [MACRO, MICRO, MACRO]
    assert programme.target.tolist() == [1680.0, 1.5e-3, 1680.0]
    assert programme.hold.tolist() == [0.5, 3600.0, 2.0]
    assert programme.title == "wave"
    assert programme.source == str(tmp_path / "wave.toml")


def test_lists_expand_and_macro_moves_are_whole_counts(tmp_path: Path) -> None:
    text = """
    [[moves]]
    macro = ["9.95 mm", "20 mm"]
    micro = ["1 mm", "2 mm"]
    hold = "2 s"
    macro_hold = "1 s"
    [[moves]]
    micro = ["0.5 mm", "0 mm"]
    hold = "3 s"
    """
    programme = read(tmp_path, text)
    assert programme.target.tolist() == [139, 1e-3, 2e-3, 280, 1e-3, 2e-3, 0.5e-3, 0]
    assert programme.hold.tolist() == [1, 2, 2, 1, 2, 2, 3, 3]


MOVE = '[[moves]]\nmacro = "10 mm"\nhold = "1 s"\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        # unknown keys
        (MOVE + 'hodl = "1 s"', ["move 1, hodl", "unknown key", "such as hold"]),
        ('[[moves]]\nmacro = "1 mm"\nhodl = "1 s"', ["move 1, hodl", "unknown key"]),
        ("speed = 3\n" + MOVE, ["speed", "unknown key", "title, moves"]),
        # missing and wrong units
        (MOVE + MOVE.replace("10 mm", "10"), ["move 2, macro", "'10'", "mm", "counts"]),
        (MOVE.replace("10 mm", "10 s"), ["move 1, macro", "'10 s'"]),
        (MOVE.replace("1 s", "1"), ["move 1, hold", "'1'", "ms"]),
        (MOVE.replace('"1 s"', "1"), ["move 1, hold", "'1'", "'2 s'"]),
        (MOVE.replace('"10 mm"', "nan"), ["move 1, macro", "nan"]),
        ('[[moves]]\nmicro = "20 counts"\nhold = "1 s"', ["move 1, micro", "20 counts"]),
        # out of range
        (MOVE.replace("10 mm", "201 mm"), ["move 1, macro", "0 mm to 200 mm (0 to 2800 counts)"]),
        (MOVE.replace("10 mm", "-1 counts"), ["-1 counts", "0 to 2800 counts"]),
        (MOVE.replace("10 mm", "1e300 m"), ["1e300 m", "2800 counts"]),
        ('[[moves]]\nmicro = "3.9 mm"\nhold = "1 s"', ["move 1, micro", "0 mm to 3.8 mm"]),
        ('[[moves]]\nmicro = ["1 mm", "-1 um"]\nhold = "1 s"', ["micro", "'-1 um'"]),
        (MOVE.replace("1 s", "0 s"), ["hold", "more than 0 s, at most 1 h"]),
        (MOVE.replace("1 s", "-1 s"), ["hold", "more than 0 s"]),
        (MOVE.replace("1 s", "61 min"), ["hold", "at most 1 h"]),
        # NaN and infinity
        (MOVE.replace("10 mm", "nan mm"), ["'nan mm'", "finite"]),
        (MOVE.replace("1 s", "inf s"), ["'inf s'", "finite"]),
        # the shape
        ('[[moves]]\nhold = "1 s"', ["move 1", "neither macro nor micro"]),
        (MOVE + 'micro = "1 mm"', ["move 1", "both macro and micro", "Give one of them"]),
        (MOVE + 'micro = ["1 mm"]', ["move 1", "both macro and micro"]),
        ('[[moves]]\nmacro = "1 mm"', ["move 1, hold", "missing", "2 s"]),
        (MOVE + 'macro_hold = "1 s"', ["move 1, macro_hold", "lists of both"]),
        ('[[moves]]\nmacro = []\nhold = "1 s"', ["move 1", "the list is empty"]),
        ('[[moves]]\nmacro = [5]\nhold = "1 s"', ["move 1, macro", "text with a unit"]),
        ('[moves]\nmacro = "1 mm"\nhold = "1 s"', ["moves", "[[moves]]"]),
        ("moves = []", ["moves", "[[moves]]"]),
        ("moves = [3]", ["moves", "[[moves]]"]),
        ('title = "no moves"', ["moves", "nothing"]),
        ("title = 5\n" + MOVE, ["title", "'5'", "text"]),
        ('title = "a\\nb"\n' + MOVE, ["title", "one line"]),
        (f'title = "{"x" * 201}"\n' + MOVE, ["title", "200"]),
        ('"a\\u001b[31m" = 1\n' + MOVE, ["a\\x1b[31m", "unknown key"]),
        # the file
        ("", ["the file is empty"]),
        ("# only a comment\n", ["moves", "nothing"]),
        ("[[moves]\n", ["TOML", "line 1"]),
        (b"title = '\xff'", ["0xff at offset 9"]),
        (b"\x00\x01\x02", ["control character"]),
    ],
)
def test_wrong_toml(tmp_path: Path, text: str | bytes, words: list[str]) -> None:
    message = refused(tmp_path, text)
    for word in words:
        assert word in message


def test_a_product_of_lists_cannot_fill_the_memory(tmp_path: Path) -> None:
    macro, micro = '"1 mm",' * 2000, '"1 mm",' * 2000
    text = f'[[moves]]\nmacro = [{macro}]\nmicro = [{micro}]\nhold = "1 s"'
    assert f"at most {MAX_MOVES}" in refused(tmp_path, text)


def test_csv_with_too_many_moves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("macromicro.programme.scheduled.MAX_MOVES", 2)
    text = "t_s,macro_counts\n0,1\n1,2\n2,3\n3,3\n"
    assert "it has 3 moves. Give at most 2" in refused(tmp_path, text, ".csv")


def test_wrong_files(tmp_path: Path) -> None:
    for name in ("wave.txt", "wave", ".toml"):
        (tmp_path / name).write_text(MOVE)
        with pytest.raises(InputError, match=r"\.toml or \.csv"):
            load(tmp_path / name, LIMITS)
    for name in ("folder", "folder.csv", "folder.toml"):
        (tmp_path / name).mkdir()
        with pytest.raises(InputError, match="this is a folder"):
            load(tmp_path / name, LIMITS)
    for name in ("none.toml", "none.csv"):
        with pytest.raises(InputError, match="no such file"):
            load(tmp_path / name, LIMITS)


def test_csv_is_a_zero_order_hold(tmp_path: Path) -> None:
    text = """\ufefft_ms, macro_mm, "micro_um"\r
    # the stages start from 0: no move for the micro-stage here\r
    0,    100, 0\r
    4000, 100, 1500  # a fine step\r
\r
    5000, 100, 1500\r
    6000, 50,  300\r
    9500, 50,  0\r
    9900, 50,  0\r
    """
    programme = read(tmp_path, text, ".csv")
    assert programme.start.tolist() == [0, 4, 6, 6, 9.5]
    assert programme.stage.tolist() == [MACRO, MICRO, MACRO, MICRO, MICRO]
    assert programme.target.tolist() == [1400, 1.5e-3, 700, 0.3e-3, 0]
    assert programme.hold.tolist() == [4.0, 2.0, 3.5, 3.5, 9.9 - 9.5]
    assert programme.end == 9.9
    assert programme.scheduled


def test_csv_with_what_was_learned_beyond_its_targets(tmp_path: Path) -> None:
    text = "t_s,micro_um,macro_mm,micro_correction_um\n"
    rows = "0,100,0,0\n1,200,0,-3\n2,200,0,4\n3,200,10,4\n4,200,10,4\n"
    programme = read(tmp_path, text + rows, ".csv")
    assert programme.stage.tolist() == [MACRO, MICRO, MICRO, MICRO, MACRO, MICRO]
    assert programme.target.tolist() == pytest.approx([0, 1e-4, 2e-4, 2e-4, 140, 2e-4])
    assert programme.correction.tolist() == pytest.approx([0, 0, -3e-6, 4e-6, 0, 4e-6])
    assert programme.set_points[2] == pytest.approx(197e-6)
    twice = programme.repeated(2)
    assert twice.correction.tolist() == programme.correction.tolist() * 2
    plain = read(tmp_path, "t_s,micro_um\n0,100\n1,200\n2,200\n", ".csv")
    assert len(plain.correction) == 0
    assert plain.set_points is plain.target


def test_what_was_learned_goes_back_into_the_file(tmp_path: Path) -> None:
    text = "# a wave\nt_ms, micro_um\n0,100\n500,100\n1000,200\n2000,300\n3000,300\n"
    programme = read(tmp_path, text, ".csv")
    learned = programme._replace(correction=np.array([1e-6, -2e-6, 3.25e-6]))
    path = tmp_path / "wave.csv"
    again = with_corrections(path, learned)
    assert again == (
        "t_ms,micro_um,micro_correction_um\n0,100,1.0000\n500,100,1.0000\n"
        "1000,200,-2.0000\n2000,300,3.2500\n3000,300,3.2500\n"
    )
    path.write_text(again)
    back = load(path, LIMITS)
    assert back.correction.tolist() == pytest.approx(learned.correction.tolist())
    assert with_corrections(path, back) == again, "its own column is replaced"


def test_csv_with_one_stage_in_counts(tmp_path: Path) -> None:
    programme = read(tmp_path, "macro_counts,t_s\n1680,1\n1680.3,2\n0,3\n0,4\n", ".csv")
    assert programme.target.tolist() == [1680, 0]
    assert programme.start.tolist() == [1, 3]
    assert programme.hold.tolist() == [2, 1]


def test_csv_that_ends_elsewhere_comes_back_when_repeated(tmp_path: Path) -> None:
    programme = read(tmp_path, "t_s,micro_mm\n0,0\n1,1\n2,1\n", ".csv").repeated(2)
    assert programme.target.tolist() == [0, 1e-3, 0, 1e-3]
    assert programme.start.tolist() == [0, 1, 2, 3]
    assert programme.end == 4


HEAD = "t_s,macro_mm,micro_mm\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD + "0,0,0\n1,10,0\n1,20,0\n", ["line 4", "increase"]),
        (HEAD + "0,0,0\n\n# x\n2,10,0\n1,20,0\n", ["line 6", "1 s", "more than 2 s"]),
        (HEAD + "0,0,0\n1,nan,0\n2,0,0\n", ["line 3, macro_mm", "'nan'", "finite"]),
        (HEAD + "0,0,0\n1,0,inf\n2,0,0\n", ["line 3, micro_mm", "'inf'"]),
        (HEAD + "0,0,0\n1e999,0,0\n", ["line 3, t_s", "1e999"]),
        (HEAD + "-1,0,0\n1,0,0\n", ["line 2, t_s", "0 to 24 h"]),
        (HEAD + "0,0,0\n1e6,1,0\n2e6,1,0\n", ["line 3, t_s", "24 h"]),
        (HEAD + "0,250,0\n1,0,0\n", ["line 2, macro_mm", "250 mm", "0 to 2800 counts"]),
        (HEAD + "0,0,0\n1,0,4\n2,0,4\n", ["line 3, micro_mm", "4 mm", "0 mm to 3.8 mm"]),
        (HEAD + "0,0,0\n1,0\n", ["line 3: the heading has 3 cells, this line 2"]),
        (HEAD + "0,0,0\n1,0,\n", ["line 3, micro_mm", "an empty cell"]),
        (HEAD + "0,0,0\n1,1_0,0\n", ["line 3, macro_mm", "1_0"]),
        (HEAD + "0,0,0\n1,10,0\n", ["line 3", "macro changes in the last row", "Repeat the row"]),
        (HEAD + "0,0,0\n1,0,0\n", ["no moves"]),
        (HEAD + "0,10,0\n", ["one row", "two or more"]),
        (HEAD, ["no rows"]),
        ("# nothing\n", ["no header", "t_s"]),
        ("0,0,0\n1,0,0\n", ["line 1, column '0'", "t_s or t_ms"]),
        ("t_s,macro\n0,0\n", ["line 1, column 'macro'", "macro_mm or macro_counts"]),
        ("t_s,macro_mm,macro_mm\n0,0,0\n", ["column macro_mm", "macro_mm and macro_mm"]),
        ("t_s,macro_mm,macro_counts\n0,0,0\n", ["macro_mm and macro_counts are", "Give one."]),
        ("t_s,t_ms,macro_mm\n0,0,0\n", ["t_s and t_ms"]),
        ("macro_mm,micro_mm\n0,0\n", ["line 1", "t_s"]),
        ("t_s,macro_mm,micro_correction_um\n", ["column micro_correction_um", "stands alone"]),
        (
            "t_s,micro_um,micro_correction_um\n0,1,-2\n1,1,-2\n",
            ["line 2, micro_correction_um", "0 mm to 3.8 mm"],
        ),
        ("t_s\n0\n", ["line 1", "macro_mm"]),
        ("t_s;macro_mm\n0;0\n", ["line 1", "semicolons", "commas", "points"]),
        ("t_s\tmacro_mm\n0\t0\n", ["line 1", "tabs", "commas"]),
        (HEAD + "0;0;0\n", ["line 2", "semicolons"]),
        (HEAD + '0,"0,0\n', ["line 2", "quotes"]),
        ("", ["the file is empty"]),
        ("t_s,macro_mm\n0,1\n".encode("utf-16"), ["UTF-8", "offset 0"]),
        (b"\x89PNG\r\n\x1a\n", ["0x89 at offset 0"]),
    ],
)
def test_wrong_csv(tmp_path: Path, text: str | bytes, words: list[str]) -> None:
    message = refused(tmp_path, text, ".csv")
    for word in words:
        assert word in message


def test_repeated_sequence_stays_a_sequence() -> None:
    thesis = load(shipped()["thesis"], LIMITS)
    ten = thesis.repeated(10)
    assert np.array_equal(ten.target.reshape(10, -1), np.tile(thesis.target, (10, 1)))
    assert np.isnan(ten.start).all()
    assert math.isnan(ten.end)
    once = thesis.repeated(1)
    assert all(np.array_equal(a, b) for a, b in zip(once[2:5], thesis[2:5], strict=True))


@pytest.mark.parametrize("n", [0, -1, MAX_MOVES])
def test_repeated_refuses_impossible_numbers(n: int) -> None:
    with pytest.raises(InputError, match=f"a whole number from 1 to {MAX_MOVES // 40}"):
        load(shipped()["thesis"], LIMITS).repeated(n)


@given(st.integers(1, 20))
@settings(max_examples=20)
def test_a_repeated_schedule_never_goes_back_in_time(n: int) -> None:
    stairs = load(shipped()["staircase"], LIMITS)
    many = stairs.repeated(n)
    assert many.end == n * stairs.end
    assert (np.diff(many.start) >= 0).all()
    assert many.start[-1] < many.end
    assert np.array_equal(many.start.reshape(n, -1)[-1] - (n - 1) * stairs.end, stairs.start)


LEVELS = st.lists(st.integers(0, 2800), min_size=2, max_size=20)


@given(LEVELS)
@settings(max_examples=50)
def test_the_moves_of_a_csv_give_its_column_back(
    tmp_path_factory: pytest.TempPathFactory, levels: list[int]
) -> None:
    """Zero-order hold: the latest move's target is the row's value at every time."""
    levels = [*levels, levels[-1]]
    rows = "".join(f"{k},{level}\n" for k, level in enumerate(levels))
    folder = tmp_path_factory.mktemp("csv")
    if not any(levels):
        refused(folder, "t_s,macro_counts\n" + rows, ".csv")
        return
    programme = read(folder, "t_s,macro_counts\n" + rows, ".csv")
    t = np.arange(len(levels) - 1) + 0.5
    last = np.searchsorted(programme.start, t) - 1
    held = np.where(last < 0, 0.0, programme.target[last])
    assert held.tolist() == levels[:-1]
    ends = programme.start + programme.hold
    assert np.array_equal(ends, [*programme.start[1:], programme.end])


@given(st.binary(max_size=200), st.sampled_from([".toml", ".csv"]))
@settings(max_examples=100)
def test_any_bytes_are_a_programme_or_an_input_error(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, suffix: str
) -> None:
    folder = tmp_path_factory.getbasetemp()
    with suppress(InputError):
        read(folder, junk, suffix)
