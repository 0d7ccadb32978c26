"""README and docs show the claims as the procedures measure them."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest

from macromicro.thesis.claims import DIFFERS, STATEMENTS, Claim

from .ended import measured

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    """docs/make_bench.py as a module."""
    spec = importlib.util.spec_from_file_location("make_bench", DOCS / "make_bench.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def now() -> list[Claim]:
    return [measured(name) for name in STATEMENTS]


def test_readme_has_what_is_measured_now(maker: ModuleType, now: list[Claim]) -> None:
    assert maker.blocks(ROOT / "README.md")["count"] == maker.counted(now)


def test_reproduction_page_counts_and_names_what_differs(
    maker: ModuleType, now: list[Claim]
) -> None:
    page = (DOCS / "validation" / "reproduce.md").read_text(encoding="utf-8")
    blocks = maker.blocks(DOCS / "validation" / "reproduce.md")
    assert blocks["count"] == maker.counted(now)
    assert blocks["bands"] == maker.bands(now)
    assert blocks["turned"] == maker.turned()
    assert blocks["misprints"] == maker.misprints()
    for claim in now:
        assert (f"- **{claim.id}**:" in page) == (claim.verdict == DIFFERS), claim.id


def test_heat_at_five_volts_decides_s12(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter more would meet the 50 um, as the claim's reason says; a relay density that
    scatters more or less would not."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    import calibration

    plain, more = calibration.heat_sensitivity((1.0, 1.25))
    assert plain.error == pytest.approx(38.4, abs=1.0)
    assert more.error > 50.0
    assert "a quarter more" in measured("S12").reason
