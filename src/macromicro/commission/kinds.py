"""What can be commissioned: each a file, and a line here."""

from __future__ import annotations

from macromicro.commission import axis, piezo, rotary, wire
from macromicro.commission.procedure import Kind

KINDS: tuple[Kind, ...] = (
    axis.KIND,
    piezo.KIND,
    wire.KIND,
    rotary.KIND,
)
NAMES = tuple(kind.name for kind in KINDS)


def named(name: str) -> Kind | None:
    """The kind that gives a machine.

    Parameters
    ----------
    name : str
        Of the machine.

    Returns
    -------
    Kind | None
        None: it cannot be commissioned.
    """
    return next((kind for kind in KINDS if kind.name == name), None)
