"""docs/measured_page.py, which measures validation/beyond.md: what is kept."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module."""
    monkeypatch.syspath_prepend(str(DOCS))
    import measured_page

    yield measured_page
    sys.modules.pop("measured_page")


@pytest.fixture
def both(page: ModuleType) -> Iterator[ModuleType]:
    """docs/make_beyond_both.py."""
    import make_beyond_both

    yield make_beyond_both
    for name in ("make_used", "make_beyond_both", "make_beyond_micro", "make_beyond", "beyond"):
        sys.modules.pop(name, None)


def _one(job: tuple[str, int, int]) -> dict[str, Any]:
    """Stands for a measurement: in another process, so it has to be a module's own."""
    kind, k, value = job
    return {"kind": kind, "bench": k, "value": value}


@pytest.mark.parametrize(
    ("given", "renewed"),
    [
        (["--only", "1"], [("a", 1), ("b", 1)]),
        (["--kind", "b"], [("b", 0), ("b", 1), ("b", 2)]),
        (["--kind", "b", "--only", "0", "2"], [("b", 0), ("b", 2)]),
        (["--rest"], []),
    ],
)
def test_only_some_benches_are_measured_anew(
    given: list[str], renewed: list[tuple[str, int]], page: ModuleType, tmp_path: Path
) -> None:
    """Those that are named; the others stay as they were, in their order."""
    results = tmp_path / "found.json"
    kept = [{"kind": kind, "bench": k, "value": 0} for kind in "ab" for k in range(3)]
    results.write_text(json.dumps(kept))
    written: list[Any] = []
    shown = page.Study(
        tmp_path / "page.md", results, lambda _: [(kind, k, 7) for kind in "ab" for k in range(3)],
        _one, lambda _: {}, written.append,
    )  # fmt: skip
    page.main(None, shown, given)
    wanted = [{**b, "value": 7 if (b["kind"], b["bench"]) in renewed else 0} for b in kept]
    assert json.loads(results.read_text()) == wanted == written[0]


def test_other_seeds_leave_the_page_alone(
    page: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """`--seed 3` draws with it, prints the tables, and writes beside the published results."""
    results = tmp_path / "found.json"
    study = page.Study(
        tmp_path / "page.md", results, lambda chosen: [("a", 1, page.seed(chosen, 7))], _one,
        lambda every: {"mark": f"value {every[0]['value']}"},
        lambda _: pytest.fail("a figure was drawn"),
    )  # fmt: skip
    page.main(None, study, ["--seed", "3", "--scratch", str(tmp_path / "scratch")])
    assert capsys.readouterr().out == "mark\nvalue 3\n"
    assert not results.exists()
    beside = tmp_path / "scratch" / "found-seed-3.json"
    assert json.loads(beside.read_text()) == [{"kind": "a", "bench": 1, "value": 3}]


def test_a_table_is_written_between_its_marks(page: ModuleType, tmp_path: Path) -> None:
    place = tmp_path / "page.md"
    place.write_text("A\n<!-- one -->\nold\n<!-- end -->\n<!-- two -->\n<!-- end -->\n")
    page.put(place, "one", page.table(["", "b"], [["1", ""], ["a|b", "2"]]))
    assert page.blocks(place) == {"one": "|  | b |\n|---|---|\n| 1 |  |\n| a|b | 2 |\n", "two": ""}
    with pytest.raises(SystemExit, match="no mark three"):
        page.put(place, "three", "")


def test_published_seed_without_another(page: ModuleType) -> None:
    """7 for 7."""
    assert page.seed(page.parsed(None, []), 7) == 7
    assert page.seed(page.parsed(None, ["--seed", "0"]), 7) == 0


def _both(fine: list[dict[str, Any]] | None) -> dict[str, Any]:
    own: dict[str, Any] = {"arrived": [0.4], "first": [0.1], "laser": [-0.2], "true": [0.3]}
    return {"law": own if fine is None else {**own, "fine": fine}}


def _return(least: float | None, near: float = 1.0) -> dict[str, Any]:
    return {"from": 1.0, "to": 0.0, "least": least, "near": near}


def test_a_bench_without_limits_counts_for_all_else(both: ModuleType) -> None:
    """Neither moves that were stopped nor a room too warm for a place take a bench away."""
    stopped, warm = _both(None), _both([_return(None), *[_return(0.5)] * 8, _return(0.5)])
    late = _both([_return(0.5), *[_return(0.5)] * 8, _return(None)])
    slow = _both([_return(0.5)] * 9 + [_return(1.4)])  # the hold of 2 s would hide how late it is
    for bench in (stopped, warm, late, slow):
        assert [*both.rows([bench], "law").values()] == [[0.4], [0.1], [0.2], [0.3], [], [], []]
    good = _both([_return(0.5)] * 9 + [_return(0.75, 1.5)])
    found = both.rows([stopped, warm, good], "law")
    assert [*found.values()][4:] == [[2.0], [1.5], [1.5]]


def test_a_place_that_no_input_reaches_has_no_limit(both: ModuleType) -> None:
    """Extended to 0 in a room that holds the wires contracted: None, and no error."""
    import make_beyond_micro

    from macromicro.plant import bench
    from macromicro.settings import Settings

    settings = Settings()
    plant = bench.prepare(settings.bench, settings.sensors)
    state = bench.initial(plant)
    assert make_beyond_micro.limited(plant, state, 0.0) == 0.0
    assert make_beyond_micro.limited(plant, state, 9.0) is None


@pytest.mark.slow
def test_the_page_says_what_motor_and_wires_are_asked_for(
    page: ModuleType, both: ModuleType
) -> None:
    """As measured now; nothing is beyond what the table itself allows."""
    import make_used

    table = make_used.used_table(make_used.Settings())
    assert table in (DOCS / "validation" / "beyond.md").read_text(encoding="utf-8")
    cells = [line.strip("|").split("|") for line in table.splitlines()[2:]]
    judged = [row for row in cells if row[1].strip() != "-"]
    assert len(judged) >= 7
    assert all(float(used) <= float(row[1]) for row in judged for used in row[2:])


def test_the_heat_that_a_wire_takes_follows_from_the_printed_ones(both: ModuleType) -> None:
    """At a printed cross-section it is the printed current's; the longest time is a whole one."""
    import make_used

    from macromicro.schema.par import changed

    for diameter, ohm, amps in make_used.WIRES:
        area = 0.25 * np.pi * diameter**2
        one = changed(make_used.Settings(), {"bench.wire.area": 1e-6 * area})
        assert make_used.printed(one) == pytest.approx(ohm * amps**2)
    busy = np.array([1, 0, 1, 1, 1, 0, 1, 1], dtype=bool)
    assert make_used.longest(busy, 0.5) == 1.5
    assert make_used.longest(~busy | busy, 0.5) == 4.0
    assert make_used.longest(busy & False, 0.5) == 0.0
