"""Executes a client's commands: permissions, order with stops, errors."""

from __future__ import annotations

import inspect

from macromicro.errors import InputError, MacromicroError
from macromicro.serve.requests import CONTROL, EVERYONE, STOPS
from macromicro.serve.scpi._message import Unit
from macromicro.serve.scpi._session import Session
from macromicro.serve.scpi.command import Answer, Call
from macromicro.serve.scpi.errors import ScpiError


async def attempt(session: Session, unit: Unit, stops: int, failed: int) -> Answer:
    """Execute one command: its response, or None; an error goes to the session's queue."""
    command = unit.command
    try:
        if command.access == CONTROL:
            if session.stops != stops:
                raise ScpiError(-200, f"{command.header} not done: it came before a stop")
            if session.failed != failed:
                raise ScpiError(-200, f"{command.header} not done: error before it")
        if command.access not in (EVERYONE, STOPS) and session.gone:
            raise ScpiError(-200, f"{command.header} not done: the client is gone")
        return await _run(session, unit)
    except ScpiError as error:
        session.fail(error)
        return None


async def _run(session: Session, unit: Unit) -> Answer:
    command = unit.command
    try:
        if command.access != STOPS:  # a stop waits for nothing
            session.poll()
        if command.access not in (EVERYONE, STOPS) and not session.authenticated:
            raise ScpiError(-203, "SYSTem:AUTHenticate first")
        call = Call(session, unit.values, unit.suffixes)
        if command.blocks:
            answer = await session.in_thread(command.act, call)
        else:
            answer = command.act(call)
        return await answer if inspect.isawaitable(answer) else answer
    except ScpiError:
        raise
    except InputError as error:
        raise ScpiError(-224, str(error)) from error
    except MacromicroError as error:
        raise ScpiError(-200, str(error)) from error
    except Exception as error:
        raise ScpiError(-310, f"{type(error).__name__}: {error}") from error
