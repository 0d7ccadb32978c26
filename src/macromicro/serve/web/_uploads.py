"""Programmes that a viewer uploads in pieces."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from macromicro.serve._programmes import Planned
from macromicro.serve.web._orders import Refusal, number, text

MOST = 4_000_000  # characters of a programme: some 100,000 rows
_NAME = re.compile(r"[\w .()+-]{1,100}\.(toml|csv)", re.IGNORECASE)


class Upload:
    """One viewer's programme: the pieces so far, and its plan once complete."""

    def __init__(self) -> None:
        self.name = ""
        self.plan: Any = None
        self._pieces: list[str] = []
        self._size = 0

    def take(self, order: dict[str, Any], load: Callable[[str, str], Planned]) -> dict[str, Any]:
        """Take one piece of a programme; how much has come, and at the end the number of moves."""
        name, offset, piece = text(order, "name"), number(order, "offset"), order.get("text")
        if not _NAME.fullmatch(name):
            raise Refusal(
                f"{name!r:.60} is not a file name of a programme", "a name with .toml or .csv"
            )
        if not isinstance(piece, str):
            raise Refusal("a piece without text", "send text")
        if offset == 0.0:
            self.name, self.plan, self._pieces, self._size = name, None, [], 0
        if name != self.name or offset != self._size:
            raise Refusal(f"a piece at {offset:.0f} of {name}", "begin the upload again")
        self._size += len(piece)
        if self._size > MOST:
            self._pieces, self._size = [], 0
            raise Refusal(f"{name} has more than {MOST} characters", "shorten the programme")
        self._pieces.append(piece)
        if order.get("last") is not True:
            return {"size": self._size}
        whole, self._pieces = "".join(self._pieces), []
        found = load(whole, name)
        self.plan = found.plan
        return {"size": self._size, "moves": found.moves}
