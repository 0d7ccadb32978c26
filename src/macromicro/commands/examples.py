"""``macromicro examples [FOLDER]``: copies the example files."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).parents[1]


def examples(folder: Path = Path("examples")) -> None:
    """Copy example machines, sweeps, scripts, data and tutorials."""
    import shutil

    from macromicro.errors import ProblemError
    from macromicro.schema.text import printable

    if folder.exists():
        remedy = "Name a new one: macromicro examples FOLDER."
        raise ProblemError(printable(folder, 300), "the folder already exists", remedy)
    for source, place in _sources().items():
        shutil.copytree(source, folder / place, ignore=shutil.ignore_patterns("__pycache__"))
    print(f"examples: {folder}")
    print(f"then: macromicro run --config {printable(folder / 'machines/stage.toml', 300)}")


def _sources() -> dict[Path, str]:
    """Folders to copy: those of the wheel, or of a checkout."""
    if (_PACKAGE / "examples").is_dir():
        return {_PACKAGE / "examples": ""}
    checkout = _PACKAGE.parents[1]
    return {checkout / "examples": "", checkout / "docs/tutorials": "tutorials"}
