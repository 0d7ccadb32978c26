"""The generated C of every unit without its comments, and the variables of its FMU.

The last bits of a table depend on the processor on which numpy computed it, so the numbers of the
code are compared by their sum.
"""

from __future__ import annotations

import hashlib
import math
import re

import pytest

from macromicro.export import catalogue, files
from macromicro.export.fmu import Interface

from .record import frozen

UNITS = tuple(catalogue.every())
NUMBER = re.compile(r"(?<![\w.])\d+\.\d*(?:[eE][-+]?\d+)?|(?<![\w.])\d+[eE][-+]?\d+")
LARGE = 1e6  # beside such a number the others would not be seen in the sum


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
    values = [float(number) for number in NUMBER.findall(code)]
    values = [value for value in values if value < LARGE]
    found = {
        "code": hashlib.sha256(NUMBER.sub("number", code).encode()).hexdigest(),
        "numbers": {"count": len(values), "sum": math.fsum(values)},
        "variables": shown,
    }
    frozen(f"export/{name}", found)
