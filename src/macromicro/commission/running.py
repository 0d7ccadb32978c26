"""A whole commissioning: subject, steps, model, machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from macromicro import __version__
from macromicro.commission import _store, _verifying, axis, procedure
from macromicro.commission._settings import TOLERANCE, as_file
from macromicro.commission._verifying import Shifted, Verified
from macromicro.commission.procedure import Kind, Options, Robustness, Step, Tuned, Work
from macromicro.commission.stand import Stand
from macromicro.machines import machine as machines
from macromicro.machines import results
from macromicro.machines.composite import AnyMachine
from macromicro.rig.session import Session
from macromicro.schema.par import entries
from macromicro.schema.text import printable

VERIFY, TUNE = "verification", "gains by search on the model"
COMPARE = _verifying.STEP.title
# From a machine, its settings and its rigs with their zeros to a calibration.
Calibrate = Callable[[AnyMachine, Any, tuple[Shifted, ...]], Any]
_CRUISE = 0.9  # of the greatest speed that is allowed, which is then the guard's


class Place(NamedTuple):
    name: str  # for people
    make: Callable[[int], Any]  # gives the rig for a seed
    dt: float  # control period, s
    pitch: float  # travel per encoder count, m
    effort: float  # largest effort that its drive takes, V; NaN where nobody has said it
    real: bool  # real hardware
    kind: Kind = axis.KIND
    # lowest effort that its drive takes, V; None: as far below zero as `effort` is above
    lowest: float | None = None
    endless: bool = False  # continuous rotation

    def asked(self, options: Options) -> dict[str, Any]:
        here = {"of": self.name, "kind": self.kind.name, "dt": self.dt, "pitch": self.pitch}
        return {**here, **options._asdict()}


class Commissioned(NamedTuple):
    work: Work  # each step's result
    model: Any  # of what they found; of the kind's type
    toml: str  # the machine's file
    settings: Any  # of the machine's file
    verified: Verified  # result of the verification
    # tolerance within which the model came to rest, m; None: as it follows from the encoder
    rested: float | None = None
    margins: Robustness = Robustness()  # of the gains
    tuned: Tuned = Tuned()  # result of the search for gains
    calibration: Any = None  # None: it was not calibrated


def commission(
    place: Place,
    options: Options,
    out: Path | None = None,
    *,
    seed: int = 0,
    ask: Callable[[str, str], None] = lambda title, intent: None,
    done: Callable[[str], None] = lambda title: None,
    ended: Callable[[], bool] = lambda: False,
    calibrate: Calibrate | None = None,
) -> Commissioned:
    """Commission a stage; `calibrate` follows a verification whose moves all arrived."""
    options = options.checked()
    _check_known(place)
    kind, asked = place.kind, place.asked(options)
    before = {} if out is None else _store.read(out, kind, asked)

    def kept(step: Step, found: Any) -> None:
        if out is not None:
            _store.keep(out, step, found, place.dt, asked)
        done(step.title)

    with Session(place.make(seed), place.dt) as session:
        stand = Stand(session, place.dt, place.pitch, ended, kind.place)
        work = Work(stand, options, before)
        procedure.perform(kind, work, lambda step, intent: ask(step.title, intent), kept)
        model = kind.model(work)
        # Reckoned before anything moves again: what sinks by its weight sinks meanwhile.
        rested, tuned = _reckoned(place, work, model, done, ended)
        tuned = _compared(place, work, model, (rested, tuned), ask, kept)
        toml, tree, on, verified = _verified(place, work, model, (rested, tuned), ask)
        if tuned.gains and not verified.met:
            # A stage may hum under gains of a search, though it arrived sooner by them before.
            found = f"{results.arrived(verified.moves)} of {verified.asked}"
            doubt = f"With the gains of the search {found} moves of the verification arrived"
            doubt += f" ({verified.fault})" if verified.fault else ""
            doubt += "; it was repeated with the gains of the rules."
            tuned = Tuned(doubts=(*tuned.doubts, doubt))
            work.stand.rest(work.options.caution(work.options.creep))
            toml, tree, on, verified = _verified(place, work, model, (rested, tuned), ask)
        done(VERIFY)
        calibration = None
        if calibrate is not None and verified.met:
            calibration = calibrate(machines.named(kind.name, "machine"), tree, (on,))
    robust = _margins(kind, tree, model)
    return Commissioned(work, model, toml, tree, verified, rested, robust, tuned, calibration)


def _check_known(place: Place) -> None:
    """Check the known values against the machine's file before any motion."""
    settings = machines.named(place.kind.name, "machine").settings
    known = {entry.path: entry for entry in entries(settings)}
    known["timing.period"].check(place.dt, f"--rig {printable(place.name, 200)}, dt")
    known["encoder.pitch"].check(place.pitch, "--pitch")


def _verified(
    place: Place,
    work: Work,
    model: Any,
    reckoned: tuple[float | None, Tuned],
    ask: Callable[[str, str], None],
) -> tuple[str, Any, Shifted, Verified]:
    """The machine's file, its settings, the rig with its zero, and the verification."""
    kind, more = place.kind, _more(place, *reckoned)
    tree = _settings(place, work, model, None, more)[1]
    what = f"makes {len(_verifying.SHARES)} moves within its travel with these gains"
    ask(VERIFY, f"{kind.homing} and {what}, {_most(kind, tree)}.")
    home = kind.home(work, model)
    toml, tree = _settings(place, work, model, home, more)
    machine = machines.named(kind.name, "machine")
    on = Shifted(work.stand)
    return toml, tree, on, _verifying.verify(on, machine, tree)


def _reckoned(
    place: Place, work: Work, model: Any, done: Callable[[str], None], ended: Callable[[], bool]
) -> tuple[float | None, Tuned]:
    """Tolerance of the model, and gains that beat the rules' on it."""
    kind, tuned = place.kind, Tuned()
    tree = _settings(place, work, model, None)[1]
    machine = machines.named(kind.name, "machine")
    rested = None if kind.rehearse is None else kind.rehearse(machine, tree)
    if kind.tune is not None:

        def progress(count: int, best: float) -> None:
            del count, best
            if ended():
                raise KeyboardInterrupt

        tree = _settings(place, work, model, None, _more(place, rested, tuned))[1]
        try:
            tuned = kind.tune(tree, model, progress)
        except Exception as error:  # whatever a kind of the user's does
            tuned = Tuned(doubts=(_failed("A search for better gains failed", error),))
        done(TUNE)
    return rested, tuned


def _compared(
    place: Place,
    work: Work,
    model: Any,
    reckoned: tuple[float | None, Tuned],
    ask: Callable[[str, str], None],
    kept: Callable[[Step, Any], None],
) -> Tuned:
    """The searched gains, or none where the stage itself settles no faster."""
    kind, (rested, tuned) = place.kind, reckoned
    compare = kind.compare
    if compare is None or not tuned.gains:
        return tuned
    machine = machines.named(kind.name, "machine")
    trees = [
        _settings(place, work, model, None, _more(place, rested, one))[1]
        for one in (Tuned(), tuned)
    ]
    # Gains may change how closely a stage rests: both are judged by what both can hold.
    within = max(float(tree.arrival.tolerance) for tree in trees)

    def tried(one: Tuned) -> tuple[float, str]:
        home = kind.home(work, model)
        tree = _settings(place, work, model, home, _more(place, within, one))[1]
        found = compare(work.stand, machine, tree)
        # What stops a run lets go of a weight, too.
        work.stand.rest(work.options.caution(work.options.creep))
        return found

    found = work.found.get(_verifying.STEP.name)
    if found is None or found.gains != _verifying.listed(tuned):
        ask(
            COMPARE,
            f"{kind.homing} and makes {len(_verifying.COMPARED_SHARES)} moves within its travel, "
            "with the gains of the rules and then with those of the search, "
            f"{_most(kind, trees[0])}.",
        )
        found = _verifying.compared(tried, tuned)
        kept(_verifying.STEP, found)
    return _verifying.faster(found, tuned)


def _most(kind: Kind, tree: Any) -> str:
    told = kind.place.told
    return (
        f"at up to {told(tree.motion.velocity, 'm/s', 3)}, "
        f"{told(tree.motion.acceleration, 'm/s^2', 3)} and {tree.guard.effort:.3g} V"
    )


def _more(place: Place, rested: float | None, tuned: Tuned) -> dict[str, str]:
    unit = place.kind.place.base
    rest = {} if rested is None else {TOLERANCE: f'"{rested!r} {unit}"'}
    return {**rest, **tuned.gains}


def _margins(kind: Kind, tree: Any, model: Any) -> Robustness:
    """Robustness of the gains; a failure loses no results."""
    try:
        return kind.margins(tree, model)
    except Exception as error:  # whatever a kind of the user's does
        return Robustness(
            (), (_failed("The robustness of the gains could not be computed", error),)
        )


def _failed(what: str, error: Exception) -> str:
    """Note of a failed computation."""
    return f"{what} ({f'{type(error).__name__}: {error}'[:200]})."


def _settings(
    place: Place, work: Work, model: Any, home: Any, more: Mapping[str, str] = MappingProxyType({})
) -> tuple[str, Any]:
    kind = place.kind
    values = {**kind.settings(work, model, home), **more}
    toml, tree = _made(place, work, model, values)
    fastest = work.options.speed
    if tree.guard.speed <= fastest:
        return toml, tree
    # Nothing is known of it at speeds that it was not allowed, and it is not allowed them now.
    unit, cruise = kind.place.named("m/s"), min(tree.motion.velocity, _CRUISE * fastest)
    slower = {"motion.velocity": cruise, "guard.speed": fastest}
    capped = {path: f'"{speed!r} {unit}"' for path, speed in slower.items()}
    return _made(place, work, model, {**values, **capped})


def _made(place: Place, work: Work, model: Any, values: dict[str, str]) -> tuple[str, Any]:
    return as_file(values, _head(place, work, model), place.kind.name)


def _head(place: Place, work: Work, model: Any) -> str:
    kind = place.kind
    lines = [f"Found by commissioning {printable(place.name, 200)} with macromicro {__version__}."]
    if procedure.sign(kind, work) < 0.0:
        lines.append(kind.turned)
    lines += ["", f"As found, in V and {kind.place.base}, with 95 % intervals:"]
    for name, one in kind.estimates(model).items():
        lines.append(f"  {name} = {one.value:.4g} +- {one.half:.2g} {one.unit}")
    return "\n".join([*lines, kind.head])
