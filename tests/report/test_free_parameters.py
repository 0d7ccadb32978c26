"""The benches' parameters, counted."""

from __future__ import annotations

from macromicro.parameters import entries
from macromicro.plant.cycle import CycleBench
from macromicro.plant.kiln import KilnBench
from macromicro.report import free_parameters
from macromicro.report.free_parameters import CALIBRATED, GROUPS, grouped
from macromicro.report.free_parameters import free_parameters as listed
from macromicro.settings import Settings

SETTINGS = Settings()
EVERY = [
    e
    for tree in (SETTINGS.bench, SETTINGS.sensors, KilnBench(), CycleBench())
    for e in entries(tree)
]


def test_each_meaning_once_and_in_one_group() -> None:
    found = listed(SETTINGS)
    assert sorted(p.meaning for p in found) == sorted({e.par.meaning for e in EVERY})
    groups = grouped(found)
    assert tuple(groups) == GROUPS
    assert sum(len(members) for members in groups.values()) == len(found)


def test_what_shares_a_meaning_is_the_same_parameter() -> None:
    """Within one bench no two parameters are told by the same words."""
    for tree in (SETTINGS.bench, SETTINGS.sensors, KilnBench(), CycleBench()):
        meanings = [e.par.meaning for e in entries(tree)]
        assert len(set(meanings)) == len(meanings)


def test_calibrated_parameters_name_claims() -> None:
    calibrated = grouped(listed(SETTINGS))[CALIBRATED]
    assert len(calibrated) == len({e.par.meaning for e in EVERY if "calibrated" in e.par.source})
    assert all(p.claims for p in calibrated)
    by_path = {p.path: p for p in calibrated}
    assert by_path["friction.coulomb"].claims == ("M2", "M3")
    assert by_path["driver.map_heat"].claims == ("S3", "S4", "S5", "S6", "S7")
    assert by_path["driver.map_heat"].numbers == len(SETTINGS.bench.driver.map_heat)


def test_values_have_units_and_say_where_another_bench_differs() -> None:
    by_path = {p.path: p for p in listed(SETTINGS)}
    assert by_path["wire.stop"].value == "3.98 mm"
    assert by_path["driver.supply"].others == ("cycle bench: 5 V",)
    assert by_path["encoder.pitch"].others == ("kiln: 14 um", "cycle bench: 17 um")
    assert by_path["driver.map_ctrl"].value.endswith("2.1, 5 V")
    assert by_path["wire.length"].others == ()


def test_an_assumed_value_is_no_fact_of_the_thesis() -> None:
    by_path = {p.path: p for p in listed(SETTINGS)}
    assert by_path["driver.contract_on"].group == free_parameters.ASSUMED
    assert by_path["flexure.modulus"].group == free_parameters.THESIS
    assert by_path["wire.austenite"].group == free_parameters.LITERATURE
