"""What to do where a package that only some users need is missing."""

from __future__ import annotations


def remedy(extra: str) -> str:
    """Say how to install one of the package's extras.

    Parameters
    ----------
    extra : str
        Its name.

    Returns
    -------
    str
        From an index, and in a checkout.
    """
    return (
        f"an installation with it: pip install 'macromicro[{extra}]', "
        f"in a checkout .venv/bin/pip install -e '.[{extra}]'"
    )
