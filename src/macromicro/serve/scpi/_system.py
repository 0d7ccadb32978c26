from __future__ import annotations

import json

from macromicro.control.live.messages import Refused
from macromicro.serve import telling
from macromicro.serve.requests import TOKEN
from macromicro.serve.scpi._parameters import Number, Text
from macromicro.serve.scpi.command import Answer, Call, Command, block, number
from macromicro.serve.scpi.errors import ScpiError, quoted

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
    return f"{first + 1},{number(event.time)}," + ",".join(map(quoted, words))


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
    Command(
        "SYSTem:ERRor[:NEXT]?",
        lambda call: call.session.errors.get().shown(),
        "Take the oldest error out of this connection's queue.",
        answer='number, "text"; 0, "No error" if there is none',
    ),
    Command(
        "SYSTem:ERRor:ALL?",
        _all_errors,
        "Take all errors out of the queue.",
        answer='number, "text", and so on',
    ),
    Command(
        "SYSTem:ERRor:COUNt?",
        lambda call: str(len(call.session.errors)),
        "Errors in the queue.",
        answer="number",
    ),
    Command("SYSTem:VERSion?", lambda call: VERSION, "Version of SCPI.", answer=VERSION),
    Command(
        "SYSTem:HELP:HEADers?",
        _headers,
        "The headers of all commands, with /qonly/ for a query without a command and /nquery/ for "
        "a command without a query.",
        answer="block of text, a line each",
        cost=5,
    ),
    Command(
        "SYSTem:AUTHenticate",
        _authenticate,
        "Give the token, if the server requires one. A wrong token costs a second; after five "
        "within a minute, over all connections and the page, the address is blocked and the "
        "connection ends.",
        (Text("token", 200),),
        cost=20,
    ),
    Command(
        "SYSTem:LOCK:REQuest?",
        _request,
        "Request control, which one client at a time holds.",
        answer="1, or 0 if another client holds it",
        access=TOKEN,
    ),
    Command(
        "SYSTem:LOCK:RELease",
        _release,
        "Give control back. A jog ends; any other motion continues to its end.",
        access=TOKEN,
    ),
    Command(
        "SYSTem:LOCK:OWNer?",
        lambda call: quoted(call.session.snapshot().holder),
        "Who holds control.",
        answer='"client", or "" for none',
    ),
    Command(
        "SYSTem:LOCK:WATChdog",
        _watchdog,
        "Silence after which this client counts as lost although connected; 0 for never. It is not "
        "counted while *OPC? or *WAI wait, and is serve.client_timeout longer while commands are "
        "pending.",
        (Number("time", "s", lo=0, hi=3600),),
    ),
    Command(
        "SYSTem:LOCK:WATChdog?", lambda call: number(call.session.watchdog), "The time.", answer="s"
    ),
    Command(
        "SYSTem:CLIent?",
        lambda call: quoted(call.session.name),
        "The name under which this connection is known.",
        answer='"client"',
    ),
    Command(
        "EVENt[:NEXT]?",
        _event,
        "The oldest unread event since this client connected.",
        answer='number, time s, "kind", "from mode", "to mode", "cause", "evidence" (JSON); '
        "number 0 if there is none",
    ),
    Command("EVENt:COUNt?", _events, "Events not read yet.", answer="number"),
)
