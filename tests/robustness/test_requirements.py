"""Limits: the defaults, a user's own, and what is wrong with a file of them."""

from __future__ import annotations

from pathlib import Path

import pytest

from macromicro.batch.programme_metrics import METRICS, NAMES
from macromicro.errors import InputError
from macromicro.robustness import requirements
from macromicro.robustness.requirements import Requirement
from macromicro.robustness.subject import usual_requirements
from macromicro.robustness.words import amount
from macromicro.uncertainty.table import UNCERTAIN

REQUIRED = usual_requirements(METRICS, {})


def written(folder: Path, text: str, name: str = "limits.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def load(path: Path) -> tuple[Requirement, ...]:
    return requirements.load(path, METRICS[:-1], REQUIRED)


def test_defaults() -> None:
    limits = {r.metric.name: r.limit for r in REQUIRED}
    assert limits["micro_error"] == 5.0
    assert limits["fault"] == 0.0
    assert all(r.source for r in REQUIRED)


def test_a_file_changes_adds_and_removes(tmp_path: Path) -> None:
    path = written(
        tmp_path, 'macro_settling = "800 ms"\nvibration = "0.026 mm"\nmicro_overshoot = false\n'
    )
    found = {r.metric.name: r for r in load(path)}
    assert found["macro_settling"].limit == 0.8
    assert found["macro_settling"].source == "limits.toml"
    assert found["vibration"].limit == pytest.approx(26.0)
    assert "micro_overshoot" not in found
    assert found["micro_error"] in REQUIRED
    assert list(found) == [n for n in NAMES if n in found]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('macro_setling = "1 s"', "macro_settling"),
        ('macro_settling = "1 mm"', "min"),
        ("macro_settling = 1", "macro_settling"),
        ('macro_settling = "-1 s"', "zero or more"),
        ("macro_settling = true", '"5 s"'),
        ("macro_settling = [1]", "false for none"),
        ("fault_code = 1", "unknown metric"),
        ('macro_settling = "nan s"', "macro_settling"),
        ("", "empty"),
        ("# nothing", "the file sets no limit"),
        ("macro_settling = ", "TOML"),
        ("\n".join(f"{r.metric.name} = false" for r in REQUIRED), "no requirement"),
    ],
)
def test_slips_are_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        load(written(tmp_path, text))
    assert words in str(caught.value)
    assert "limits.toml" in str(caught.value)


def test_other_files(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"suffix is '?\.txt"):
        load(written(tmp_path, "fault = 0", "limits.txt"))
    with pytest.raises(InputError, match="no such file"):
        load(tmp_path / "none.toml")


def test_limits_in_words() -> None:
    words = {r.metric.name: r.text for r in REQUIRED}
    assert words["macro_settling"] == "at most 0.95 s"
    assert words["fault"] == "none"


def test_the_page_in_docs_lists_what_the_code_has() -> None:
    """Every uncertain parameter with its range and settings; every limit with its source."""
    page = (Path(__file__).parents[2] / "docs" / "validation" / "tuning.md").read_text(
        encoding="utf-8"
    )
    for u in UNCERTAIN:
        paths = ", ".join(f"`{path}`" for path, _ in u.parts)
        between = f"{amount(u, u.low)} to {amount(u, u.high)}"
        assert f"| `{u.name}` | {between} | {u.meaning} | {paths} |" in page
    for r in REQUIRED:
        assert f"| `{r.metric.name}` | {r.metric.meaning} | {r.text} | {r.source} |" in page
