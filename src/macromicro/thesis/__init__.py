"""The thesis' laboratory: a folder per chapter with its procedures, claims and figures.

Only `reproduce` and `collect` use it; `contents.toml` lists the procedures in the thesis' order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from macromicro.thesis.procedure import Procedure


def all_procedures() -> list[Procedure]:
    from macromicro.thesis.contents import NAMES, find

    return [find(name) for name in NAMES]
