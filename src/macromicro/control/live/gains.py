"""New gains for a running machine, checked against their bounds, all or none."""

from __future__ import annotations

from typing import Any

from macromicro.control import micro, settings
from macromicro.control.live import messages as m
from macromicro.control.live import transitions as t
from macromicro.control.live.messages import Accepted, Change, Notice, Refused, Reply
from macromicro.control.live.parameters import LiveParameters
from macromicro.control.live.plain import show
from macromicro.control.live.state import REST, LiveState, Running, busy
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.schema.config import problems
from macromicro.schema.par import Entry, entries, replaced

LIST = "`macromicro config show controller` lists all settings and their bounds"
FIXED = ("motor_limit", "ctrl_limit")  # they belong to the driver and its guard


def change(
    p: LiveParameters, s: LiveState, changes: Any
) -> tuple[LiveState, Reply, tuple[Notice, ...]]:
    if refused := waits(p, s):
        return s, refused, ()
    found = take_changes(s.control, changes, FIXED)
    if isinstance(found, Refused):
        return s, found, ()
    new: Control = found[0]
    most = 2.0 * p.settings.fine.bias_high / p.settings.pitch
    if new.sequence.tolerance > most:
        words = f"sequence.tolerance: {new.sequence.tolerance:g} count is above {most:.0f} count"
        return s, Refused(words, "the limit is twice the reach of the micro-stage"), ()
    if refused := unfit(new):
        return s, refused, ()
    if busy(s) and (new.macro_law, new.micro_law) != (s.control.macro_law, s.control.micro_law):
        return s, Refused("a motion is under way", "change the law when it has ended"), ()
    s = _put(p, s, new)
    return s, Accepted(0, found[1]), (gains_event(s, found[1]),)


def waits(p: LiveParameters, s: LiveState) -> Refused | None:
    """Why no gains can be changed now."""
    if busy(s) and p.settings.gains_while_moving != 1:
        return Refused("a motion is under way", "wait for its end, or stop it")
    return None


def take_changes(
    control: Any, changes: Any, fixed: tuple[str, ...] = ()
) -> tuple[Any, tuple[Change, ...]] | Refused:
    known = {e.path: e for e in entries(control)}
    done: list[Change] = []
    pairs = changes if isinstance(changes, tuple) and changes else (None,)
    for pair in pairs:
        one = _take_change(known, pair, fixed)
        if isinstance(one, Refused):
            return one
        control = replaced(control, one.path, one.new)
        done.append(one)
    return control, tuple(done)


def unfit(tree: Any) -> Refused | None:
    """The setting that does not fit the others."""
    for path, value, accepted in problems(tree):
        return Refused(f"{path}: {value} does not fit the others", f"accepted: {accepted}")
    unstable = tree.unstable() if hasattr(tree, "unstable") else []
    for path, value, accepted in unstable:
        spoken = next(e.par for e in entries(tree) if e.path == path).spoken(value)
        return Refused(f"{path}: {spoken} does not fit the others", f"accepted: {accepted}")
    return None


def gains_event(s: LiveState, done: tuple[Change, ...]) -> Notice:
    """The event of new gains."""
    facts = {c.path: {"old": c.old, "new": c.new} for c in done}
    return t.report(s, "gains", "set gains", facts)


def _put(p: LiveParameters, s: LiveState, new: Control) -> LiveState:
    """Put settings in force without a jump of the micro effort, if the law integrates."""
    laws = settings.prepare(new, False, p.calibration, p.settings.pitch)
    old = s.laws.micro
    integral = s.drive.integral
    if s.mode in (m.HOLDING, m.MOVING_MICRO):
        error = s.drive.micro_reference - s.seen.fine
        integral += (old.kp - laws.micro.kp) * error
    if laws.micro.ki == 0.0:  # a law without an integral has no such memory
        integral = 0.0
    drive = s.drive._replace(integral=integral)
    if new.micro_law != s.control.micro_law:
        drive = drive._replace(fine=micro.begin(laws.fine))
    if laws.sequence.park != s.laws.sequence.park and _is_parked(s):
        # What is held from now on is where the carriage is, wherever it was parked.
        drive = drive._replace(macro_reference=s.seen.encoder, memory=REST)
    return s._replace(control=new, laws=laws, drive=drive)


def _is_parked(s: LiveState) -> bool:
    """Whether the micro-stage has its turn outside of a programme."""
    return s.mode in (m.HOLDING, m.MOVING_MICRO) and not isinstance(s.work, Running)


def _take_change(known: dict[str, Entry], pair: Any, fixed: tuple[str, ...]) -> Change | Refused:
    if not isinstance(pair, tuple) or len(pair) != 2:
        return Refused("the setting or its value is missing", LIST)
    path, value = pair
    entry = known.get(path) if isinstance(path, str) else None
    if path in fixed:
        return Refused(f"{path} follows from the machine", "set it in the settings file")
    if entry is None:
        return Refused(f"{show(path)} is not a setting of the controller", LIST)
    try:
        return Change(path, entry.value, entry.check(value, path))
    except InputError as error:
        return Refused(
            f"{path}: {show(entry.par.given(value))}", f"accepted: {error.accepted}; {LIST}"
        )
