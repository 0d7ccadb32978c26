"""Optional packages."""

from __future__ import annotations


def remedy(extra: str) -> str:
    """How to install one of the package's extras."""
    return (
        f"in a checkout: .venv/bin/pip install -c constraints.txt -e '.[{extra}]'; "
        f"of a wheel: pip install 'macromicro-VERSION-py3-none-any.whl[{extra}]'"
    )
