"""The room's front door: every public name loads, and nothing heavy comes with them."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from macromicro import design

HEAVY = {"h5py", "matplotlib", "numba", "pint", "pydantic", "scipy", "xarray"}


def test_every_public_name_loads() -> None:
    for name in design._HOMES:
        assert getattr(design, name) is not None
    assert set(design._HOMES) <= set(dir(design))
    with pytest.raises(AttributeError, match="bearing"):
        _ = design.bearing


def test_no_name_is_a_module_s() -> None:
    assert set(design._HOMES).isdisjoint({*design._HOMES.values(), "extension", "vibration"})


def test_a_sheet_costs_no_heavy_import() -> None:
    script = (
        "import json, sys\nfrom macromicro import design\n"
        "empty = [m for m in sys.modules if m.startswith('macromicro.design.')]\n"
        "for name in design._HOMES: getattr(design, name)\n"
        "print(json.dumps([empty, sorted(sys.modules)]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    before, after = json.loads(done.stdout)
    assert before == []
    assert "macromicro.design.costs" in after and HEAVY.isdisjoint(after)
