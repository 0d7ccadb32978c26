"""Errors that a user can cause and fix."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class MacromicroError(Exception):
    """Base of this package's errors. The command line prints it and exits with 1."""

    exit_status = 1


class ArrivalWarning(UserWarning):
    """Moves of a run did not arrive: names them, the largest error and a remedy.

    Issued once per run by `macromicro.run` and by runs of other machines in memory. To make a
    run fail, turn it into an error:
    ``warnings.simplefilter("error", macromicro.ArrivalWarning)``.
    """


class InputError(MacromicroError):
    """A bad value: where it stands, what was found and what is accepted.

    Exit status 2.

    Parameters
    ----------
    where : str
        A file, a key or a line ("wave.toml, moves[2].macro").
    value : Any
        The value found; "" to show none.
    accepted : str
        What is accepted.

    Examples
    --------
    >>> from macromicro import InputError
    >>> print(InputError("travel", "12 V", "a number with a unit: m or mm").at("wave.toml, travel"))
    wave.toml, travel: '12 V'; accepted: a number with a unit: m or mm
    """

    exit_status = 2

    def __init__(self, where: str, value: Any, accepted: str) -> None:
        self.where = where
        self.value = value
        self.accepted = accepted
        super().__init__(self._message())

    @property
    def found(self) -> str:
        """The message without what is accepted."""
        if isinstance(self.value, str) and not self.value:
            return self.where
        return f"{self.where}: {self.value!r}"

    def _message(self) -> str:
        return f"{self.found}; accepted: {self.accepted}"

    def at(self, where: str) -> InputError:
        """The same error at another place.

        Parameters
        ----------
        where : str
            The new place, such as the old one behind a file's name.

        Returns
        -------
        InputError
            Of the same class.
        """
        return type(self)(where, self.value, self.accepted)


class ProblemError(InputError):
    """A problem that the user can fix, with its remedy.

    Parameters
    ----------
    where : str
        A file, a folder or an option ("results/x", "--fan"); "" where the problem names it.
    problem : str
        A clause ("the folder already exists").
    remedy : str
        A sentence ("Choose another one or add --overwrite."); "" where there is none.

    Examples
    --------
    >>> from macromicro.errors import ProblemError
    >>> print(ProblemError("t1", "the folder already exists", "Choose another one."))
    t1: the folder already exists. Choose another one.
    """

    def __init__(self, where: str, problem: str, remedy: str = "") -> None:
        super().__init__(where, problem, remedy)

    @property
    def found(self) -> str:
        """The message without the remedy."""
        return f"{self.where}: {self.value}" if self.where else str(self.value)

    def _message(self) -> str:
        return f"{self.found.rstrip('.')}. {self.accepted}" if self.accepted else self.found


@contextmanager
def naming_arguments() -> Iterator[None]:
    """Name an argument of Python ("held_out") where an error names an option ("--held-out").

    Yields
    ------
    None
        Errors that the block raises name arguments.

    Raises
    ------
    InputError
        That of the block.

    Examples
    --------
    >>> from macromicro.errors import InputError, naming_arguments
    >>> try:
    ...     with naming_arguments():
    ...         raise InputError("--held-out", "5", "between 0 and 1")
    ... except InputError as error:
    ...     print(error.where)
    held_out
    """
    try:
        yield
    except InputError as error:
        if not error.where.startswith("--"):
            raise
        raise error.at(error.where[2:].replace("-", "_")) from None
