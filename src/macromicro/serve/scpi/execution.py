"""The doing of a client's commands: who may, what comes before a stop, and errors to its queue."""

from __future__ import annotations

from macromicro.errors import InputError, MacromicroError
from macromicro.serve.requests import CONTROL, EVERYONE, STOPS
from macromicro.serve.scpi.command import Answer, Call
from macromicro.serve.scpi.errors import ScpiError
from macromicro.serve.scpi.message import Unit
from macromicro.serve.scpi.session import Session


def attempt(session: Session, unit: Unit, stops: int, failed: int) -> Answer:
    """Do one command: its response data, None if it has none or cannot be done; then the error
    is in the session's queue.

    `stops`, `failed`: of this client when the message came, and when its first command was
    begun; what needs control is not done behind a later stop, nor behind an error in the same
    message.
    """
    command = unit.command
    try:
        if command.access == CONTROL:
            if session.stops != stops:
                raise ScpiError(-200, f"{command.header} not done: it came before a stop")
            if session.failed != failed:
                raise ScpiError(-200, f"{command.header} not done: error before it")
        if command.access in (EVERYONE, STOPS):
            return _run(session, unit)
        if session.gone.is_set():
            raise ScpiError(-200, f"{command.header} not done: the client is gone")
        answer = _run(session, unit)
        if session.gone.is_set():  # it went while it was given control, perhaps
            session.station.disconnect(session.name)
        return answer
    except ScpiError as error:
        session.fail(error)
        return None


def _run(session: Session, unit: Unit) -> Answer:
    """Raises ScpiError only."""
    command = unit.command
    try:
        if command.access != STOPS:  # a stop waits for nothing
            session.poll()
        if command.access not in (EVERYONE, STOPS) and not session.authenticated:
            raise ScpiError(-203, "SYSTem:AUTHenticate first")
        return command.act(Call(session, unit.values, unit.suffixes))
    except ScpiError:
        raise
    except InputError as error:
        raise ScpiError(-224, str(error)) from error
    except MacromicroError as error:
        raise ScpiError(-200, str(error)) from error
    except Exception as error:
        raise ScpiError(-310, f"{type(error).__name__}: {error}") from error
