"""Checks that a machine of another package meets the contract of single-stage machines."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from macromicro import place as places
from macromicro.arrays import Array
from macromicro.control.contract import Broken, Finding, Look, looked
from macromicro.errors import InputError
from macromicro.kernel import compiled, is_kernel
from macromicro.machines import composite, period, planning, results, runs, stage, tree
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
    looks: tuple[tuple[str, Look], ...] = (
        ("shape", _shape),
        ("settings", _settings),
        ("kernels", _kernels),
        ("start", _start),
        ("direction", _direction),
        ("compiled", _compiled),
        ("moves", _moves),
        ("model", _model),
    )
    for each in looked(machine, looks, ("shape", "kernels", "start")):
        yield each
        if not each.passed and each.what in ("shape", "kernels", "start"):
            return


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
    found = [each for each in check(machine) if not each.passed]
    return [f"{each.what}: {each.found}; {each.remedy}" for each in found]


def _shape(machine: Machine) -> str:
    settings = machine.settings
    if not is_set(settings) or not hasattr(settings, "derived"):
        raise Broken(f"settings: {printable(settings)[:80]}", "a NamedTuple under @machine_tree")
    missing = [name for name in SETS if not is_set(getattr(settings, name, None))]
    if missing:
        raise Broken(f"settings without {', '.join(missing)}", f"the sets {', '.join(SETS)}")
    if not isinstance(settings.controller, machine.law.gains):
        found = f"controller is a {type(settings.controller).__name__}"
        raise Broken(found, f"the law's gains, a {machine.law.gains.__name__}")
    if places.of(settings) != machine.kind.place:
        found = f"travel in {places.of(settings).base}, kind in {machine.kind.place.base}"
        raise Broken(found, "settings and `Kind.place` of one unit")
    shown = (name for name in settings._fields if name not in (tree.OWN, tree.GIVEN))
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
    if again != settings:
        wrong = ", ".join(config.difference(again, settings))
        raise Broken(f"{wrong} change on the way through TOML", "each field with a Par")
    if tree.settled(settings) != settings:
        wrong = ", ".join(config.difference(tree.settled(settings), settings))
        raise Broken(f"{wrong} do not follow their rules", "settings that are settled(...)")
    return f"{sum(1 for _ in entries(settings))} parameters, within their bounds"


def _kernels(machine: Machine) -> str:
    names = stage.kernels_of(machine.kind)
    plain = [name for name in names if not is_kernel(getattr(machine.kind, name))]
    if plain:
        raise Broken(f"{', '.join(plain)} of the kind: plain Python", "mark them with @kernel")
    return ", ".join(names)


def _noise(machine: Machine, count: int) -> Array:
    return noise_source(1).standard_normal((count, machine.kind.noises))


def _start(machine: Machine) -> str:
    kind, settings = machine.kind, machine.settings
    params, dt = kind.prepare(settings), settings.timing.period
    state, noise = kind.initial(params), _noise(machine, 2)
    sample = kind.measure(params, state, 0.0, noise, 0)
    if type(sample) is not Sample or sample.t != 0.0:
        raise Broken(f"measure gives {printable(sample)}", "Sample(t, position in m)")
    allowed = 3.0 * settings.arrival.tolerance
    if not abs(sample.position) <= allowed:
        raise Broken(f"{sample.position:g} m at the start", f"at rest at 0 m, within {allowed:g} m")
    if type(kind.show(params, state)) is not kind.truth:
        raise Broken("show gives another type", f"a {kind.truth.__name__}, its `truth`")
    after = kind.advance(params, state, 1.0, noise, 0, dt)
    if type(after) is not type(state):
        raise Broken(f"advance gives a {type(after).__name__}", f"a {type(state).__name__}")
    again = kind.advance(params, kind.initial(params), 1.0, noise, 0, dt)
    if repr(again) != repr(after):
        raise Broken("the same start gave another state", "no attribute, global, clock or chance")
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


def _compiled(machine: Machine) -> str:
    settings = machine.settings
    plan = planning.plan(planning.usual(settings), settings)
    stages, noise = composite.stages(machine), (_noise(machine, _PERIODS),)
    control, bench = runs.loops(machine, settings, plan), composite.bench(machine, settings)
    interpreted, found = period.period(stages), []
    for run in (interpreted, compiled(interpreted)):
        begin = period.beginning(stages, bench, control)
        out = np.zeros((len(period.columns(stages)), _PERIODS))
        try:
            run(bench, control, begin, noise, out, settings.timing.period)
        except Exception as error:
            words = " ".join(str(error).split())[:200]
            remedy = "floats, math and NamedTuples alone (CONTRIBUTING.md, Kernels)"
            raise Broken(f"it does not run: {words}", remedy) from None
        found.append(out)
    if not np.array_equal(found[0], found[1], equal_nan=True):
        where = int(np.argmax(np.any(found[0] != found[1], axis=0)))
        found_words = f"other bits than interpreted from period {where} on"
        raise Broken(found_words, "x * x for x**2, math.sqrt for math.hypot; no division by 0")
    return f"the same bits as interpreted over {_PERIODS} periods"


def _moves(machine: Machine) -> str:
    settings = machine.settings
    plan = planning.plan(planning.usual(settings), settings)
    done = runs.record(under(machine, settings), settings, plan, warn=False)
    if done.outcome.fault is not None:
        fault = done.outcome.fault
        words = f"{fault.message} {fault.evidence}"
        raise Broken(words, "gains, motion limits and guard that suit each other")
    moves = results.moves(done.recording, plan, settings.arrival, machine.kind.place)
    count = results.arrived(moves)
    if count < len(moves):
        found = f"{count} of the {len(moves)} usual moves arrive"
        raise Broken(found, "gains, or arrival.tolerance and patience, with which all do")
    return f"all {count} usual moves arrive"


def _model(machine: Machine) -> str:
    if machine.model is None:
        return "none: no `macromicro response`"
    frequency = np.geomspace(1.0, 0.4 / machine.settings.timing.period, 5)
    found = np.asarray(machine.model(machine.settings, frequency))
    if found.shape != frequency.shape or not np.all(np.isfinite(found)):
        raise Broken(f"model gives {printable(found)[:80]}", "a complex m/V for each frequency")
    return "a linear plant, for `macromicro response`"
