import inspect
import itertools
import math
from collections.abc import Mapping

import pytest

from macromicro.control.arrival import Sequence
from macromicro.control.pd import PdInitial, PdTuned
from macromicro.control.pi import Pi, PiAntiWindup
from macromicro.drawing import diagram, flow
from macromicro.drawing._labels import stroke
from macromicro.drawing._plan import Layout
from macromicro.drawing._symbols import FRACTION, plain
from macromicro.drawing.diagram import Diagram
from macromicro.drawing.exhibit import SVG, rendered
from macromicro.drawing.flow import Flow, targets
from macromicro.identify import _linear
from macromicro.identify.smoothing import without_spikes
from macromicro.models.macro import MacroModel
from macromicro.thesis.diagrams import DIAGRAMS, drawn

from ..drawing.geometry import check, check_frames, ids_of, nearest, text_of

BLOCKS = [
    *("2.11", "3.1", "3.5", "D.2"),
    *("4.3", "4.5", "4.6", "4.7", "4.10", "4.12", "4.15", "4.16", "4.19", "4.21"),
    *("5.1", "5.2", "5.12", "5.18", "5.21", "5.24", "6.1"),
]
CHARTS = ["4.2", "5.4"]


def laid_out(number: str) -> Layout:
    body = DIAGRAMS[number].body
    return diagram.layout(body) if isinstance(body, Diagram) else flow.layout(body)


def block_diagram(number: str) -> Diagram:
    body = DIAGRAMS[number].body
    assert isinstance(body, Diagram)
    return body


def chart(number: str) -> Flow:
    body = DIAGRAMS[number].body
    assert isinstance(body, Flow)
    return body


def test_all_numbers_are_there() -> None:
    assert {n for n, d in DIAGRAMS.items() if isinstance(d.body, Diagram)} == set(BLOCKS)
    assert {n for n, d in DIAGRAMS.items() if isinstance(d.body, Flow)} == set(CHARTS)
    with pytest.raises(KeyError):
        drawn("4.4")


@pytest.mark.parametrize("number", DIAGRAMS)
def test_nothing_overlaps_and_no_wire_crosses_a_block(number: str) -> None:
    layout = laid_out(number)
    check(layout)
    assert layout.view.w <= 700.0
    body = DIAGRAMS[number].body
    if isinstance(body, Diagram):
        check_frames(layout, {f.label: f.names for f in body.frames})


@pytest.mark.parametrize("number", BLOCKS)
def test_wires_from_different_sources_share_no_stretch(number: str) -> None:
    paths = laid_out(number).paths
    for p, q in itertools.combinations(paths, 2):
        if (p.source, p.dashed) == (q.source, q.dashed):
            continue
        for a, b in itertools.pairwise(p.points):
            for c, d in itertools.pairwise(q.points):
                if (a[0] == b[0]) == (c[0] == d[0]):
                    assert not stroke(a, b, 0.5).overlaps(stroke(c, d, 0.5)), (p, q)


@pytest.mark.parametrize("number", BLOCKS)
def test_every_text_of_the_description_is_drawn_and_every_box_wired(number: str) -> None:
    body, layout = block_diagram(number), laid_out(number)
    shown = text_of(drawn(number).body)
    for shape in body.blocks.values():
        for line in shape.lines:
            for part in line.split(FRACTION):
                assert plain(part) in shown
    ends = {p.source for p in layout.paths} | {p.target for p in layout.paths}
    assert ends == set(layout.boxes)
    for frame in body.frames:
        assert frame.label in shown


def test_ids_are_unique_over_all_diagrams() -> None:
    ids = [i for number in DIAGRAMS for i in ids_of(drawn(number).body)]
    assert len(ids) == len(DIAGRAMS) == len(set(ids))


@pytest.mark.parametrize("number", DIAGRAMS)
def test_an_exhibit_with_title_and_caption(number: str) -> None:
    exhibit = rendered(drawn(number))
    assert exhibit.kind == SVG and exhibit.number == number
    assert exhibit.title and exhibit.caption.endswith(".")
    # A caption is no markup.
    assert "_" not in exhibit.caption and "~" not in exhibit.caption


@pytest.mark.parametrize("number", CHARTS)
def test_every_step_is_reached_and_every_decision_has_both_exits(number: str) -> None:
    body = chart(number)
    reached, todo = set(), [0]
    while todo:
        k = todo.pop()
        if k not in reached:
            reached.add(k)
            todo += targets(body, k)
    assert reached == set(range(len(body.steps)))
    for k, step in enumerate(body.steps):
        if step.outline == flow.HEXAGON:
            assert [label for label, _ in step.exits] == ["yes", "no"]
            assert len(set(targets(body, k))) == 2
    layout = laid_out(number)
    for word in layout.words:
        assert body.steps[int(nearest(layout, word))].outline == flow.HEXAGON
    shown = " ".join(text_of(drawn(number).body))
    for step in body.steps:
        assert all(plain(line) in shown for line in flow.wrapped(step.text))


@pytest.mark.parametrize(
    ("number", "values"),
    [
        ("5.21", Pi()._asdict()),
        ("5.24", PiAntiWindup()._asdict()),
        ("4.19", PdInitial()._asdict()),
        ("4.21", PdTuned()._asdict()),
        ("6.1", {"wait": Sequence().wait}),
        ("4.16", {k: getattr(MacroModel(), k) for k in ("width", "a0", "delta", "limit")}),
    ],
)
def test_numbers_are_the_codes_own(number: str, values: Mapping[str, float]) -> None:
    words = " ".join(text_of(drawn(number).body)).replace("\u2212 ", "-").replace("±", "").split()
    numbers = set()
    for word in words:
        try:
            numbers.add(float(word))
        except ValueError:
            continue
    # A law without anti-windup has no such path.
    # Gains of the micro-stage are told in V/mm and V/(mm s).
    told = {
        k: 1e-3 * v if number in ("5.21", "5.24") and k in ("kp", "ki") else v
        for k, v in values.items()
    }
    assert {v for v in told.values() if v} <= numbers


def test_numbers_of_the_flow_charts_are_the_codes_own() -> None:
    smoothing = " ".join(text_of(drawn("5.4").body))
    defaults = inspect.signature(without_spikes).parameters
    for name, unit in (("steepest", "degC/s"), ("window", "s"), ("longest", "s")):
        assert f"{defaults[name].default:g}\u00a0{unit}" in smoothing
    squares = " ".join(text_of(drawn("4.2").body))
    assert f"{_linear.MAX_ITERATIONS} iterations" in squares
    assert f"1/{1.0 / _linear._TOLERANCE:.0f} " in squares


def signs(number: str) -> dict[tuple[str, str], str]:
    """Sign of each wire into a sum: the one that stands nearest to its end."""
    layout = laid_out(number)
    found: dict[tuple[str, str], str] = {}
    marks = [w for w in layout.words if w.text in ("+", "\u2212")]
    for path in layout.paths:
        end = path.points[-1]
        near = min(marks, key=lambda w: math.dist(w.rect.centre, end))
        if f"({path.target})" in block_diagram(number).grid:
            found[path.source, path.target] = near.text
    return found


def test_signs_at_the_sums() -> None:
    plus, minus = "+", "\u2212"
    assert signs("4.3") == {
        ("K_a", "e"): plus,
        ("K_b", "e"): minus,
        ("K_t", "t"): plus,
        ("F", "t"): minus,
        ("B", "t"): minus,
    }
    # dI/dt = Ki e + Kaw (sat(u) - u), u = Kp e + I
    assert signs("5.24") == {
        ("r", "e"): plus,
        ("H", "e"): minus,
        ("P", "u"): plus,
        ("I", "u"): plus,
        ("K", "w"): plus,
        ("A", "w"): plus,
        ("S", "d"): plus,
        ("u", "d"): minus,
    }
    assert signs("6.1") == {
        ("r_1", "e"): plus,
        ("Q", "e"): minus,
        ("r_2", "f"): plus,
        ("H", "f"): minus,
    }
