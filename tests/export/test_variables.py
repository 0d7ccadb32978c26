"""The variables of an FMU have the units of their annotations."""

from __future__ import annotations

import re

import pytest

from macromicro.export import catalogue, files
from macromicro.export.fmu import Interface, Variable


def variables(name: str) -> dict[str, Variable]:
    return {v.name: v for v in Interface(files.write_unit(catalogue.unit(name))).variables}


def test_units_of_a_plant() -> None:
    found = variables("axis.plant")
    units = {
        "params.delay": "s", "params.body.stiffness": "N/m", "params.body.unbalance": "N m",
        "params.body.cogging": "N", "params.body.cogging_period": "m", "effort": "V",
        "state.x": "m", "state.v": "m/s", "params.power.gain": "",
    }  # fmt: skip
    assert {each: found[each].unit for each in units} == units


def test_a_temperature_is_no_angle() -> None:
    temperatures = [v for v in variables("two_stage.plant").values() if "temperature" in v.name]
    assert temperatures
    assert {v.unit for v in temperatures} == {"degC"}


@pytest.mark.parametrize("name", catalogue.every())
def test_no_description_alone_names_a_unit(name: str) -> None:
    """What follows the last comma of a description would be the unit."""
    unit = re.compile(r", (m|s|V|N|K|A|rad|m/s2?|N/m|N m|deg C|counts?|per s)(;|$)")
    assert [v for v in variables(name).values() if not v.unit and unit.search(v.words)] == []
