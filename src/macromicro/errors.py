"""Errors that a user can cause and mend; their messages name cause and remedy."""

from __future__ import annotations


class MacromicroError(Exception):
    """Base of this package's errors. The command line prints it and exits with 1."""

    exit_status = 1


class InputError(MacromicroError):
    """Bad input: the message says where it stands, what was found and what is accepted.

    Exit status 2.

    Parameters
    ----------
    where : str
        A file, a key or a line ("wave.toml, moves[2].macro").
    value : object
        What stood there; "" or None if nothing is to be shown.
    accepted : str
        What would have been right.
    """

    exit_status = 2

    def __init__(self, where: str, value: object, accepted: str) -> None:
        self.where = where
        self.value = value
        self.accepted = accepted
        shown = value if isinstance(value, str) and not value else repr(value)
        found = f": {shown}" if shown not in ("", None) else ""
        super().__init__(f"{where}{found}; accepted: {accepted}")
