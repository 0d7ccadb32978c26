import pytest

from macromicro.drawing import flow
from macromicro.drawing._symbols import width
from macromicro.drawing.flow import Flow, ask, do, end, start, targets, wrapped

from .geometry import check, nearest, text_of

COUNT = Flow(
    "Count to ten",
    (
        start("k = 0"),
        do("k = k + 1", name="next"),
        ask("k = 10?", no="next", yes="stop"),
        do("never", aside=True, then="next"),
        end("done", name="stop"),
    ),
)


def test_steps_follow_each_other_or_jump() -> None:
    assert [targets(COUNT, k) for k in range(5)] == [[1], [2], [4, 1], [1], []]


def test_a_chart_is_laid_out_and_shows_every_text() -> None:
    layout = flow.layout(COUNT)
    check(layout)
    assert sorted(text_of(flow.svg(COUNT))) == sorted(
        ["k = 0", "k = k + 1", "k = 10?", "never", "done", "yes", "no"]
    )
    assert not layout.dots


def test_what_is_aside_stands_beside_the_step_before_it() -> None:
    boxes = flow.layout(COUNT).boxes
    assert boxes["3"].left > boxes["2"].right
    assert boxes["3"].centre[1] == pytest.approx(boxes["2"].centre[1])


def test_yes_and_no_stand_by_their_decision() -> None:
    layout = flow.layout(COUNT)
    assert [nearest(layout, word) for word in layout.words] == ["2", "2"]


@pytest.mark.parametrize("step", [do("x", then="nowhere"), ask("x?", yes="nowhere")])
def test_a_jump_to_nowhere_is_an_error(step: flow.Step) -> None:
    with pytest.raises(ValueError, match="leads nowhere"):
        flow.svg(Flow("bad", (start("s"), step, end("e"))))


def test_the_last_step_must_not_fall_through() -> None:
    with pytest.raises(ValueError, match="leads nowhere"):
        flow.svg(Flow("bad", (start("s"), do("x"))))


def test_lines_are_few_and_even_and_keep_units_with_their_numbers() -> None:
    text = "steps that are steeper than 7~C/s begin or end a spike of interference"
    lines = wrapped(text, 160.0)
    assert " ".join(lines) == text
    assert all(width(line) <= 160.0 for line in lines)
    assert any("7~C/s" in line for line in lines)
    assert wrapped("word") == ("word",)
    assert wrapped("immeasurably long", 20.0) == ("immeasurably", "long")
