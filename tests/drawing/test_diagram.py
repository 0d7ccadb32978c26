from xml.etree import ElementTree

import pytest

from macromicro.drawing import diagram
from macromicro.drawing._icons import ICONS
from macromicro.drawing.diagram import Diagram, block, framed

from .geometry import check, check_frames, text_of

LOOP = Diagram(
    "Proportional control of G & H",
    """
    r (e) K G y
    . .  <H . .
    """,
    {"K": block("K_p", "a < b"), "G": block("1//s + 1"), "H": block("H")},
    "r > e >[e'] K > G > y; G > H >- e",
    (framed("controller", "K"),),
)


def test_a_loop_is_laid_out_and_shows_every_text() -> None:
    layout = diagram.layout(LOOP)
    check(layout)
    check_frames(layout, {"controller": ("K",)})
    texts = text_of(diagram.svg(LOOP))
    assert sorted(texts) == sorted(
        ["r", "y", "Kp", "a < b", "1", "s + 1", "H", "e\u2032", "+", "\u2212", "controller"]
    )


def test_the_minus_stands_where_the_feedback_arrives() -> None:
    layout = diagram.layout(LOOP)
    (minus,) = [w.rect for w in layout.words if w.text == "\u2212"]
    (feedback,) = [p for p in layout.paths if p.source == "H"]
    x, y = minus.centre
    assert abs(x - feedback.points[-1][0]) < 15.0 and abs(y - feedback.points[-1][1]) < 15.0


def test_a_pick_off_is_dotted_and_a_crossing_is_not() -> None:
    assert len(diagram.layout(LOOP).dots) == 1
    plain = LOOP._replace(wires="r > e > K > G > y", grid="r (e) K G H y")
    assert diagram.layout(plain._replace(wires="r > e > K > G > H > y")).dots == []


def test_what_wires_share_is_drawn_once_and_every_wire_has_its_arrow() -> None:
    svg = diagram.svg(LOOP)
    layout = diagram.layout(LOOP)
    (dot,) = layout.dots
    on, back = (p for p in layout.paths if p.source == "G")
    assert f"M{on.points[0][0]:.1f} {on.points[0][1]:.1f}L" in svg
    assert svg.count(f"M{on.points[0][0]:.1f} {on.points[0][1]:.1f}") == 1
    assert f"M{dot[0]:.1f} {dot[1]:.1f}L{back.points[2][0]:.1f}" in svg
    assert svg.count('Z" fill="currentColor"') == len(layout.paths)


def test_svg_is_self_contained_scales_and_takes_the_colours_of_the_page() -> None:
    text = diagram.svg(LOOP)
    root = ElementTree.fromstring(text)
    assert root.get("role") == "img" and root.get("viewBox") and root.get("width") is None
    assert "width:100%" in root.get("style", "")
    title = root[0]
    assert title.text == "Proportional control of G & H"
    assert title.get("id") == root.get("aria-labelledby")
    colours = {e.get(k) for e in root.iter() for k in ("fill", "stroke")} - {None}
    assert colours == {"none", "currentColor"}
    assert "var(--paper" in text
    assert "href" not in text and "url(" not in text


@pytest.mark.parametrize("icon", sorted(ICONS))
def test_icons_stay_in_their_box(icon: str) -> None:
    for stroke in ICONS[icon][1]:
        assert all(abs(v) <= 1.0 for point in stroke for v in point)
    assert "<path" in diagram.svg(Diagram(icon, "u B y", {"B": block(icon=icon)}, "u > B > y"))


def test_blocks_that_flow_leftwards_down_and_up() -> None:
    ring = Diagram(
        "ring",
        """
        u (s) A
        . \u2191D \u2193B
        . .  <C
        """,
        {name: block(name) for name in "ABCD"},
        "u > s > A > B > C > D > s",
    )
    layout = diagram.layout(ring)
    check(layout)
    entry = {p.target: p.points[-2:] for p in layout.paths}
    assert entry["B"][0][1] < entry["B"][1][1]  # B is entered from above
    assert entry["s"][0][1] > entry["s"][1][1] or entry["s"][0][0] < entry["s"][1][0]


@pytest.mark.parametrize(
    "change",
    [
        {"wires": "r > q"},
        {"wires": "r -> e"},
        {"grid": "r r"},
        {"blocks": {"Z": block("Z")}},
    ],
)
def test_a_description_that_cannot_be_read_is_an_error(change: dict) -> None:
    with pytest.raises(ValueError):
        diagram.svg(LOOP._replace(**change))
