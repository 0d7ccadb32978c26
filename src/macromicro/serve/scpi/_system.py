from __future__ import annotations

import json

from macromicro.control.live.messages import Refused
from macromicro.serve import telling
from macromicro.serve.requests import TOKEN
from macromicro.serve.scpi._parameters import Number, Text
from macromicro.serve.scpi.command import Answer, Call, block, command, number
from macromicro.serve.scpi.errors import ScpiError, quote

VERSION = "1999.0"
_EVENT_TEXT = 2000


def _all_errors(call: Call) -> Answer:
    errors = call.session.errors
    found = [errors.get().shown()]
    while len(errors):
        found.append(errors.get().shown())
    return ",".join(found)


def _request(call: Call) -> Answer:
    session = call.session
    reply = session.take()
    if isinstance(reply, Refused):
        session.fail(ScpiError(-203, f"{reply.reason}; {reply.remedy}"))
        return "0"
    return "1"


def _release(call: Call) -> Answer:
    reply = call.session.station.release(call.session.name)
    if isinstance(reply, Refused):
        raise ScpiError(-203, f"{reply.reason}; {reply.remedy}")
    return None


def _watchdog(call: Call) -> Answer:
    call.session.watchdog = call.values[0]
    return None


def _authenticate(call: Call) -> Answer:
    session = call.session
    if problem := session.authenticate(call.values[0]):
        raise ScpiError(-203, problem)
    return None


def _event(call: Call) -> Answer:
    session = call.session
    last, events = session.station.events(session.event_place)
    if not events:
        return '0,0,"none","","","",""'
    first = last - len(events) + 1
    session.event_place = first
    event = events[0]
    told = telling.event(event, session.instrument.settings.controller)
    evidence = json.dumps(told.evidence, default=str)[:_EVENT_TEXT]
    words = (event.kind, event.from_mode, event.to_mode, event.cause, evidence)
    return f"{first + 1},{number(event.time)}," + ",".join(map(quote, words))


def _events(call: Call) -> Answer:
    session = call.session
    return str(len(session.station.events(session.event_place)[1]))


def _headers(call: Call) -> Answer:
    from macromicro.serve.scpi.tree import commands

    known = [c.header for c in commands(call.session.instrument.axes)]
    headers, lines = set(known), []
    for header in known:
        plain = header.removesuffix("?")
        if plain == header:
            lines.append(header if f"{header}?" in headers else f"{header}/nquery/")
        elif plain not in headers:
            lines.append(f"{header}/qonly/")
    return block("".join(f"{line}\n" for line in lines).encode())


COMMANDS = (
    command("SYSTem:ERRor[:NEXT]?", lambda call: call.session.errors.get().shown()),
    command("SYSTem:ERRor:ALL?", _all_errors),
    command("SYSTem:ERRor:COUNt?", lambda call: str(len(call.session.errors))),
    command("SYSTem:VERSion?", lambda call: VERSION),
    command("SYSTem:HELP:HEADers?", _headers, cost=5),
    command("SYSTem:AUTHenticate", _authenticate, (Text("token", 200),), cost=20),
    command("SYSTem:LOCK:REQuest?", _request, access=TOKEN),
    command("SYSTem:LOCK:RELease", _release, access=TOKEN),
    command("SYSTem:LOCK:OWNer?", lambda call: quote(call.session.snapshot().holder)),
    command("SYSTem:LOCK:WATChdog", _watchdog, (Number("time", "s", lo=0, hi=3600),)),
    command("SYSTem:LOCK:WATChdog?", lambda call: number(call.session.watchdog)),
    command("SYSTem:CLIent?", lambda call: quote(call.session.name)),
    command("EVENt[:NEXT]?", _event),
    command("EVENt:COUNt?", _events),
)
