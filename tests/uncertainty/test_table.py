"""The table of what is not known about a machine."""

from __future__ import annotations

import pytest

from macromicro.errors import InputError
from macromicro.schema.par import entries
from macromicro.settings import Settings
from macromicro.uncertainty import table
from macromicro.uncertainty.machines import centre
from macromicro.uncertainty.table import FACTOR, UNCERTAIN, VALUE, of_stage

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
paths = ["blade.mass", "load.mass"]
range = [0.9, 1.1]
meaning = "moving mass"
"""


def test_a_table_of_ones_own_is_read(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(ROW + 'weights = [1, 2.0]\nunit = "kg"\nsource = "a scale"\n')
    (row,) = table.read(path)
    assert row.parts == (("blade.mass", 1), ("load.mass", 2.0)) and row.kind == FACTOR
    assert (row.low, row.high, row.unit, row.source) == (0.9, 1.1, "kg", "a scale")
    assert row.stage == ""
    path.write_text(ROW)
    assert table.read(path)[0].parts == (("blade.mass", 1.0), ("load.mass", 1.0))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("[[quantity]]", "[quantity]"), "own.toml, quantity: "),
        ((ROW, "quantity = []"), "own.toml, quantity: '[]'; accepted: one table"),
        (("[0.9, 1.1]", '[0.9, "1.1"]'), "quantity 1, range: "),
        (("[0.9, 1.1]", "2.0"), "quantity 1, range: '2.0'"),
        (("[[quantity]]", "[[other]]"), "own.toml, quantity: 'None'; accepted: one table"),
        (('name = "mass"\n', ""), "quantity 1, name: 'None'; accepted: text"),
        (('"factor"', '"product"'), "quantity 1, kind: 'product'; accepted: factor, shift"),
        (("[0.9, 1.1]", "[1.1, 0.9]"), "quantity 1, range: '[1.1, 0.9]'"),
        (("[0.9, 1.1]", "[0.9, 1.0, 1.1]"), "quantity 1, range"),
        (("[0.9, 1.1]", '"wide"'), "quantity 1, range: 'wide'; accepted: the lower"),
        (('["blade.mass", "load.mass"]', "[]"), "quantity 1, paths: '[]'"),
        (("meaning", "meanin"), "quantity 1, meanin: unknown key. Use one of name"),
        (("range =", "weights = [1.0]\nrange ="), "quantity 1, weights: 1; accepted: 2, one"),
    ],
)
def test_a_slip_in_a_table_is_named(tmp_path, change, words):
    path = tmp_path / "own.toml"
    path.write_text(ROW.replace(*change))
    with pytest.raises(InputError) as refused:
        table.read(path)
    assert words in str(refused.value)
