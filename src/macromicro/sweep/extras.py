"""What to do where a package that only sweeps need is missing."""

from __future__ import annotations


def remedy(extra: str) -> str:
    """How to install the package's `extra`, from an index or in a checkout."""
    return (
        f"an installation with it: pip install 'macromicro[{extra}]', "
        f"in a checkout .venv/bin/pip install -e '.[{extra}]'"
    )
