"""The table of what is not known about a machine."""

from __future__ import annotations

import pytest

from macromicro.errors import InputError
from macromicro.schema.par import entries
from macromicro.settings import Settings
from macromicro.uncertainty import table
from macromicro.uncertainty.machines import centre
from macromicro.uncertainty.ranges import FACTOR, VALUE
from macromicro.uncertainty.table import UNCERTAIN, of_stage

BASE = Settings()
KNOWN = {e.path: e.value for e in entries(BASE)}
BY_NAME = {u.name: u for u in UNCERTAIN}


def test_table_names_parameters_and_sources() -> None:
    assert len(BY_NAME) == len(UNCERTAIN)
    for u, nominal in zip(UNCERTAIN, centre(BASE, UNCERTAIN), strict=True):
        assert u.low < u.high
        assert u.low <= nominal <= u.high, u.name
        assert u.meaning
        assert u.source
        assert all(isinstance(KNOWN[path], float) for path, _ in u.parts)


def test_no_two_move_the_same_setting() -> None:
    paths = [path for u in UNCERTAIN for path, _ in u.parts]
    assert len(set(paths)) == len(paths)


def test_asked_for_ranges() -> None:
    for name in ("coulomb", "stribeck", "viscous"):
        assert (BY_NAME[name].kind, BY_NAME[name].low, BY_NAME[name].high) == (FACTOR, 0.7, 1.3)
    assert (BY_NAME["ambient"].kind, BY_NAME["ambient"].low, BY_NAME["ambient"].high) == (
        VALUE,
        15.0,
        35.0,
    )


def test_each_row_belongs_to_one_stage() -> None:
    assert {*of_stage("macro"), *of_stage("micro")} == set(UNCERTAIN)
    assert not {*of_stage("macro")} & {*of_stage("micro")}


ROW = """
[[quantity]]
name = "mass"
kind = "factor"
paths = ["bench.carriage.mass", "bench.wire.creep"]
low = 0.9
high = 1.1
meaning = "moving mass"
"""


def test_a_table_of_ones_own_is_read(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(ROW + 'weights = [1, 2.0]\nsource = "a scale"\n')
    (row,) = table.read_table(path, BASE)
    assert row.parts == (("bench.carriage.mass", 1), ("bench.wire.creep", 2.0))
    assert (row.kind, row.low, row.high, row.unit) == (FACTOR, 0.9, 1.1, "")
    assert (row.source, row.stage) == ("a scale", "")
    path.write_text(ROW)
    assert table.read_table(path, BASE)[0].parts[1] == ("bench.wire.creep", 1.0)


@pytest.mark.parametrize(
    ("kind", "path", "low", "high", "found"),
    [
        ("value", "bench.carriage.mass", '"500 g"', '"1 kg"', (0.5, 1.0, "kg")),
        ("shift", "bench.thermal.ambient", '"-5 K"', '"5 K"', (-5.0, 5.0, "K")),
        ("shift", "bench.friction.coulomb", '"-500 mN"', '"1 N"', (-0.5, 1.0, "N")),
    ],
)
def test_a_range_is_read_in_the_unit_of_its_parameter(tmp_path, kind, path, low, high, found):
    file = tmp_path / "own.toml"
    text = f"paths = ['{path}']\nkind = '{kind}'\nlow = {low}\nhigh = {high}\n"
    file.write_text(f"[[quantity]]\nname = 'a'\nmeaning = 'b'\n{text}")
    (row,) = table.read_table(file, BASE)
    assert (row.low, row.high, row.unit) == found


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[[quantity]]", "[quantity]"), "own.toml, quantity: "),
        ((ROW, "quantity = []"), "own.toml, quantity: '[]'; accepted: one table"),
        (("0.9", '"0.9 kg"'), "quantity 1, low: '0.9 kg'; accepted: a plain number"),
        (("[[quantity]]", "[[other]]"), "own.toml, quantity: 'None'; accepted: one table"),
        (('name = "mass"\n', ""), "quantity 1, name: 'None'; accepted: text"),
        (('"factor"', '"product"'), "quantity 1, kind: 'product'; accepted: one of value, factor"),
        (('"factor"', '"value"'), "quantity 1, low: '0.9'; accepted: a finite number and its unit"),
        (("1.1", "0.8"), "quantity 1, high: '0.8'; accepted: more than low (0.9)"),
        (("high = 1.1\n", ""), "quantity 1, high: missing"),
        (("low = 0.9\nhigh = 1.1", "range = [0.9, 1.1]"), "quantity 1, range: unknown key"),
        (('"bench.carriage.mass", "bench.wire.creep"', ""), "quantity 1, paths: '[]'"),
        (("carriage.mass", "carriage.mas"), "paths: 'bench.carriage.mas'; accepted: a known one"),
        (("meaning", "meanin"), "quantity 1, meanin: unknown key. Accepted: "),
        (("low =", "weights = [1.0]\nlow ="), "quantity 1, weights: 1; accepted: 2, one"),
    ],
)
def test_a_slip_in_a_table_is_named(tmp_path, change, words):
    path = tmp_path / "own.toml"
    path.write_text(ROW.replace(*change))
    with pytest.raises(InputError) as refused:
        table.read_table(path, BASE)
    assert words in str(refused.value)
