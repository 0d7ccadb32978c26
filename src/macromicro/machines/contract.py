"""Checks that a machine of another package meets the contract of single-stage machines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.conformance import (
    OTHER_BITS,
    Broken,
    Checks,
    Finding,
    failures,
    perform,
    require,
    runs,
)
from macromicro.errors import InputError
from macromicro.kernel import compiled, is_kernel
from macromicro.machines import composite, performing, period, planning, results, stage, tree
from macromicro.machines import runs as machine_runs
from macromicro.machines.machine import Machine, as_toml, under
from macromicro.machines.signals import Sample
from macromicro.rig.twin import noise_source
from macromicro.schema import config
from macromicro.schema.par import entries, is_set
from macromicro.schema.text import parsed_toml, printable

SETS = ("encoder", "timing", "travel", "motion", "arrival", "controller", "guard")
_PERIODS = 300
_LONGEST = 20_000  # periods of a constant effort


def check(machine: Machine | Any) -> Iterator[Finding]:
    """Check a machine with its default settings.

    Parameters
    ----------
    machine : Machine | Any
        What a user's module offers.

    Yields
    ------
    Finding
        Each result; checks that depend on a failed one are skipped.

    Examples
    --------
    >>> from macromicro.machines.contract import check
    >>> [(each.what, each.passed) for each in check("no machine")]
    [('shape', False)]
    """
    if not isinstance(machine, Machine):
        remedy = "a macromicro.machines.machine.Machine (docs/own-machines.md)"
        yield Finding("shape", False, f"a {type(machine).__name__}", remedy)
        return
    yield from perform(_CHECKS, machine, first=("shape", "kernels", "start"))


def broken(machine: Machine | Any) -> list[str]:
    """The failed checks of a machine, for a test: an empty list if all is well.

    Parameters
    ----------
    machine : Machine | Any
        What a user's module offers.

    Returns
    -------
    list[str]
        A line for each.

    Examples
    --------
    >>> from macromicro.machines.contract import broken
    >>> broken("no machine")
    ['shape: a str; a macromicro.machines.machine.Machine (docs/own-machines.md)']
    """
    return failures(check(machine))


def _shape(machine: Machine) -> str:
    settings = machine.settings
    known = is_set(settings) and hasattr(settings, "derived")
    require(known, f"settings: {printable(settings)[:80]}", "a NamedTuple under @machine_tree")
    missing = [name for name in SETS if not is_set(getattr(settings, name, None))]
    require(not missing, f"settings without {', '.join(missing)}", f"the sets {', '.join(SETS)}")
    found = f"controller is a {type(settings.controller).__name__}"
    same = isinstance(settings.controller, machine.law.gains)
    require(same, found, f"the law's gains, a {machine.law.gains.__name__}")
    own, place = places.of(settings), machine.kind.place
    found = f"travel in {own.base}, kind in {place.base}"
    require(own == place, found, "settings and `Kind.place` of one unit")
    shown = (
        name for name in settings._fields if name not in (tree.OWN, tree.GIVEN, tree.CORRECTION)
    )
    return f"{machine.title}: {', '.join(shown)}"


def _settings(machine: Machine) -> str:
    settings = machine.settings
    try:
        for entry in entries(settings):
            if isinstance(entry.value, float) and not math.isfinite(entry.value):
                continue  # not set
            where = f"default of {entry.path}"
            one = entry._replace(value=entry.value[0]) if isinstance(entry.value, tuple) else entry
            one.check(one.value, where)
        config.check(settings, "defaults")
        table = parsed_toml(as_toml(machine, settings), "as TOML")
        table.pop(config.MACHINE)
        again = config.overridden(settings, table, "as TOML")
    except InputError as error:
        raise Broken(f"{error.where}: {error.value}", error.accepted) from None
    wrong = ", ".join(config.difference(again, settings))
    require(again == settings, f"{wrong} change on the way through TOML", "each field with a Par")
    ruled = tree.derive_all(settings)
    wrong = ", ".join(config.difference(ruled, settings))
    remedy = "settings that are settled(...)"
    require(ruled == settings, f"{wrong} do not follow their rules", remedy)
    return f"{sum(1 for _ in entries(settings))} parameters, within their bounds"


def _kernels(machine: Machine) -> str:
    names = stage.kernels_of(machine.kind)
    plain = [name for name in names if not is_kernel(getattr(machine.kind, name))]
    found = f"{', '.join(plain)} of the kind: plain Python"
    require(not plain, found, "mark them with @kernel")
    return ", ".join(names)


def _noise(machine: Machine, count: int) -> Array:
    return noise_source(1).standard_normal((count, machine.kind.noises))


def _start(machine: Machine) -> str:
    kind, settings = machine.kind, machine.settings
    params, dt = kind.prepare(settings), settings.timing.period
    state, noise = kind.initial(params), _noise(machine, 2)
    sample = kind.measure(params, state, 0.0, noise, 0)
    known = type(sample) is Sample and sample.t == 0.0
    require(known, f"measure gives {printable(sample)}", "Sample(t, position in m)")
    at, allowed = sample.position, 3.0 * settings.arrival.tolerance
    remedy = f"at rest at 0 m, within {allowed:g} m"
    require(abs(at) <= allowed, f"{at:g} m at the start", remedy)
    known, name = type(kind.show(params, state)) is kind.truth, kind.truth.__name__
    require(known, "show gives another type", f"a {name}, its `truth`")
    after = kind.advance(params, state, 1.0, noise, 0, dt)
    found, remedy = f"advance gives a {type(after).__name__}", f"a {type(state).__name__}"
    require(type(after) is type(state), found, remedy)
    again = kind.advance(params, kind.initial(params), 1.0, noise, 0, dt)
    remedy = "no attribute, global, clock or chance"
    require(repr(again) == repr(after), "the same start gave another state", remedy)
    return f"at rest at 0 m, {len(state)} states, {machine.kind.noises} draws a period"


def _direction(machine: Machine) -> str:
    kind, settings = machine.kind, machine.settings
    params, dt = kind.prepare(settings), settings.timing.period
    noise, far = _noise(machine, 1), 5.0 * settings.arrival.tolerance
    advance, show = compiled(kind.advance), compiled(kind.show)
    share = 0.5 * settings.guard.effort
    up, idle, count = kind.initial(params), kind.initial(params), 0
    while count < _LONGEST:
        up = advance(params, up, share, noise, 0, dt)
        idle = advance(params, idle, 0.0, noise, 0, dt)
        count += 1
        ahead = show(params, up)[0] - show(params, idle)[0]
        if ahead > far:
            led = f"{kind.place.fines * ahead:.3g} {kind.place.fine}"
            return f"{share:.3g} V lead {led} up within {count * dt:.3g} s"
        if ahead < -far:
            break
    led = f"{kind.place.fines * ahead:.3g} {kind.place.fine}"
    found = f"{share:g} V lead {led} up in {count * dt:.3g} s"
    raise Broken(found, "a positive effort drives up; the truth's first field is the position")


def _check_compiled(machine: Machine) -> str:
    settings = machine.settings
    plan = planning.plan(planning.usual(settings), settings)
    stages, noise = composite.stages(machine), (_noise(machine, _PERIODS),)
    control, bench = performing.loops(machine, settings, plan), composite.bench(machine, settings)
    interpreted, found = period.period(stages), []
    for run in (interpreted, compiled(interpreted)):
        begin = period.beginning(stages, bench, control)
        out = np.zeros((len(period.columns(stages)), _PERIODS))
        given = bench, control, begin, noise, out, settings.timing.period
        runs(partial(run, *given), verb="run")
        found.append(out)
    where = int(np.argmax(np.any(found[0] != found[1], axis=0)))
    same = np.array_equal(found[0], found[1], equal_nan=True)
    require(same, f"other bits than interpreted from period {where} on", OTHER_BITS)
    return f"the same bits as interpreted over {_PERIODS} periods"


def _moves(machine: Machine) -> str:
    settings = machine.settings
    plan = planning.plan(planning.usual(settings), settings)
    done = machine_runs.record(under(machine, settings), settings, plan, warn=False)
    fault = done.outcome.fault
    if fault is not None:
        words = f"{fault.message} {fault.evidence}"
        raise Broken(words, "gains, motion limits and guard that suit each other")
    moves = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
    count = results.count_arrived(moves)
    found = f"{count} of the {len(moves)} usual moves arrive"
    remedy = "gains, or arrival.tolerance and patience, with which all do"
    require(count == len(moves), found, remedy)
    return f"all {count} usual moves arrive"


def _model(machine: Machine) -> str:
    if machine.model is None:
        return "none: no `macromicro response`"
    frequency = np.geomspace(1.0, 0.4 / machine.settings.timing.period, 5)
    found = np.asarray(machine.model(machine.settings, frequency))
    right = found.shape == frequency.shape and bool(np.all(np.isfinite(found)))
    require(right, f"model gives {printable(found)[:80]}", "a complex m/V for each frequency")
    return "a linear plant, for `macromicro response`"


_CHECKS: Checks = (
    ("shape", _shape),
    ("settings", _settings),
    ("kernels", _kernels),
    ("start", _start),
    ("direction", _direction),
    ("compiled", _check_compiled),
    ("moves", _moves),
    ("model", _model),
)
