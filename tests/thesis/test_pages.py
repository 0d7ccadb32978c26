"""README and docs show the claims as the procedures measure them."""

from __future__ import annotations

from pathlib import Path

import make_bench
import measured_page
import pytest

from macromicro.thesis.claims import DIFFERS, STATEMENTS, Claim

from .ended import measured

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"


@pytest.fixture(scope="module")
def now() -> list[Claim]:
    return [measured(name) for name in STATEMENTS]


def test_readme_has_what_is_measured_now(now: list[Claim]) -> None:
    assert measured_page.blocks(ROOT / "README.md")["count"] == make_bench.counted(now)


def test_reproduction_page_counts_and_names_what_differs(now: list[Claim]) -> None:
    page = (DOCS / "validation" / "reproduce.md").read_text(encoding="utf-8")
    blocks = measured_page.blocks(DOCS / "validation" / "reproduce.md")
    assert blocks["count"] == make_bench.counted(now)
    assert blocks["bands"] == make_bench.bands(now)
    assert blocks["turned"] == make_bench.turned()
    assert blocks["misprints"] == make_bench.misprints()
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
