import itertools

import pytest

from macromicro.drawing._routing import Link, routes, vertex


def stretches(path: list) -> set:
    """All unit steps of a path."""
    steps = set()
    for (x0, y0), (x1, y1) in itertools.pairwise(path):
        for x in range(min(x0, x1), max(x0, x1)):
            steps.add(((x, y0), (x + 1, y0)))
        for y in range(min(y0, y1), max(y0, y1)):
            steps.add(((x0, y), (x0, y + 1)))
    return steps


def test_neighbours_are_joined_straight() -> None:
    (path,) = routes((2, 1), [(0, 0), (1, 0)], [Link((0, 0), (1, 0), "E", "W", "a")])
    assert path == [vertex((0, 0)), vertex((1, 0))]


def test_a_wire_goes_around_what_stands_between() -> None:
    cells = [(0, 0), (1, 0), (2, 0)]
    (path,) = routes((3, 1), cells, [Link((0, 0), (2, 0), "E", "W", "a")])
    assert all(vertex((1, 0)) not in step for step in stretches(path))
    assert len(path) > 2


@pytest.mark.parametrize(("other", "out", "shared"), [("b", "EN", False), ("a", "E", True)])
def test_wires_share_a_stretch_only_within_a_net(other: str, out: str, shared: bool) -> None:
    # From the middle on to the right, and from the middle back to the left.
    cells = [(0, 0), (1, 0), (2, 0), (0, 1)]
    links = [Link((1, 0), (2, 0), "E", "W", "a"), Link((1, 0), (0, 1), out, "W", other)]
    on, back = routes((3, 2), cells, links)
    assert bool(stretches(on) & stretches(back)) == shared


def test_no_way_is_an_error() -> None:
    taken = Link((0, 0), (1, 0), "E", "W", "a")
    with pytest.raises(ValueError, match="no way"):
        routes((2, 1), [(0, 0), (1, 0)], [taken, taken._replace(net="b")])
