"""The generated C of every unit without its comments, and the variables of its FMU."""

from __future__ import annotations

import hashlib
import re

import pytest

from macromicro.export import catalogue, files
from macromicro.export.fmu import Interface

from .record import frozen

UNITS = tuple(catalogue.every())


def bare(code: str) -> str:
    """Code without comments and layout."""
    return " ".join(re.sub(r"/\*.*?\*/|//[^\n]*", "", code, flags=re.DOTALL).split())


def test_units_are_those_that_were() -> None:
    frozen("export/units", list(UNITS))


@pytest.mark.parametrize("name", UNITS)
def test_code_and_variables(name: str) -> None:
    written = files.write_unit(catalogue.unit(name))
    code = bare(written.header) + bare(written.code)
    variables = Interface(written).variables
    shown = [f"{v.causality} {v.name} {v.unit}".rstrip() for v in variables]
    found = {"code": hashlib.sha256(code.encode()).hexdigest(), "variables": shown}
    frozen(f"export/{name}", found)
