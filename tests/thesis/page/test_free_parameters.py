"""The benches' parameters, counted."""

from __future__ import annotations

from typing import Any

import pytest

from macromicro.schema.par import entries
from macromicro.settings import Settings
from macromicro.thesis import cycle_bench, kiln_bench
from macromicro.thesis.cycle_bench import CycleBench
from macromicro.thesis.kiln_bench import KilnBench
from macromicro.thesis.page import _free_parameters
from macromicro.thesis.page._free_parameters import CALIBRATED, GROUPS, group
from macromicro.thesis.page._free_parameters import free_parameters as listed

SETTINGS = Settings()
EVERY = [
    e
    for tree in (SETTINGS.bench, SETTINGS.sensors, KilnBench(), CycleBench())
    for e in entries(tree)
]


def test_each_meaning_once_and_in_one_group() -> None:
    """Those with a source of their own on a bench once more, as that bench's."""
    found = listed(SETTINGS)
    shared = [p.meaning for p in found if ": " not in p.path]
    assert sorted(shared) == sorted({e.par.meaning for e in EVERY})
    own = [p.path for p in found if ": " in p.path]
    assert own == [
        *(f"kiln: {path}" for path in kiln_bench.OWN_SOURCES),
        *(f"cycle bench: {p}" for p in in_order(CycleBench(), cycle_bench.OWN_SOURCES)),
    ]
    groups = group(found)
    assert tuple(groups) == GROUPS
    assert sum(len(members) for members in groups.values()) == len(found)


def in_order(tree: Any, paths: dict[str, str]) -> list[str]:
    """The paths in the order of the tree, all of which it has."""
    found = [e.path for e in entries(tree) if e.path in paths]
    assert len(found) == len(paths)
    return found


@pytest.mark.parametrize(
    ("tree", "sources"),
    [(KilnBench(), kiln_bench.OWN_SOURCES), (CycleBench(), cycle_bench.OWN_SOURCES)],
    ids=["kiln", "cycle"],
)
def test_no_value_of_another_bench_goes_under_its_source(
    tree: Any, sources: dict[str, str]
) -> None:
    """A value that differs from the two-stage bench's says where it comes from."""
    usual = {e.par.meaning: e.value for e in entries(SETTINGS.bench)}
    usual |= {e.par.meaning: e.value for e in entries(SETTINGS.sensors)}
    apart = {e.path for e in entries(tree) if usual.get(e.par.meaning, e.value) != e.value}
    assert apart <= set(sources)
    assert len(apart) >= 1


def test_what_shares_a_meaning_is_the_same_parameter() -> None:
    """Within one bench no two parameters are told by the same words."""
    for tree in (SETTINGS.bench, SETTINGS.sensors, KilnBench(), CycleBench()):
        meanings = [e.par.meaning for e in entries(tree)]
        assert len(set(meanings)) == len(meanings)


def test_calibrated_parameters_name_claims() -> None:
    calibrated = group(listed(SETTINGS))[CALIBRATED]
    here = {e.par.meaning for e in EVERY if "calibrated" in e.par.source}
    there = [s for s in cycle_bench.OWN_SOURCES.values() if "calibrated" in s]
    assert len(calibrated) == len(here) + len(there)
    assert all(p.claims for p in calibrated)
    by_path = {p.path: p for p in calibrated}
    assert by_path["friction.coulomb"].claims == ("M1", "M2", "M3", "M6a", "M6b")
    assert by_path["encoder.pitch"].claims == ("M16",)
    for path in ("thermal.plate_resistance", "thermal.body_resistance", "bias.preload"):
        assert by_path[f"cycle bench: {path}"].claims == ("A1", "A2", "A3")
    assert by_path["driver.map_heat"].claims == ("S3", "S4", "S5", "S6", "S7")
    assert by_path["driver.map_heat"].numbers == len(SETTINGS.bench.driver.map_heat)


def test_values_have_units_and_another_bench_has_its_own() -> None:
    by_path = {p.path: p for p in listed(SETTINGS)}
    assert by_path["wire.stop"].value == "3.98 mm"
    assert by_path["driver.supply"].value == "4 V"
    assert by_path["cycle bench: driver.supply"].value == "5 V"
    assert by_path["kiln: encoder.pitch"].value == "14 um"
    assert by_path["cycle bench: encoder.pitch"].value == "17 um"
    assert by_path["cycle bench: encoder.pitch"].group == _free_parameters.THESIS
    assert by_path["driver.map_ctrl"].value.endswith("2.1, 5 V")


def test_a_setting_that_is_changed_is_changed_on_every_bench() -> None:
    """One actuator: the kiln and the cycle bench have the bench's own, listed once."""
    bench = SETTINGS.bench
    changed = SETTINGS._replace(bench=bench._replace(wire=bench.wire._replace(stop=3.9e-3)))
    stops = [p for p in listed(changed) if p.meaning == "mechanical stop"]
    assert [(p.path, p.value) for p in stops] == [("wire.stop", "3.9 mm")]


def test_a_chosen_stroke_is_not_told_by_the_thesis() -> None:
    """Section 3.2.1 has 4 mm, the bench 4.03 mm."""
    by_path = {p.path: p for p in listed(SETTINGS)}
    assert by_path["wire.stroke"].group == CALIBRATED
    assert "S13c" in by_path["wire.latent"].claims


def test_an_assumed_value_is_no_fact_of_the_thesis() -> None:
    by_path = {p.path: p for p in listed(SETTINGS)}
    assert by_path["driver.contract_on"].group == _free_parameters.ASSUMED
    assert by_path["flexure.modulus"].group == _free_parameters.THESIS
    assert by_path["wire.austenite"].group == _free_parameters.LITERATURE
