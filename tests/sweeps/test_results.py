"""What is said of the results."""

from __future__ import annotations

from macromicro.sweeps.results import Range, Written, ranges


def test_ranges_of_the_metrics() -> None:
    written = Written(10, 2, "", {"a": Range(10, 1.0, 2.0, 3.0), "b": Range(7, -1.0, 0.5, 2.0)})
    assert list(ranges(written, {"a": "s", "b": "", "c": "m"})) == [
        "a  1 to 3 s, mean 2",
        "b  -1 to 2, mean 0.5, a number in 7 of 10",
        "c  always NaN",
    ]
