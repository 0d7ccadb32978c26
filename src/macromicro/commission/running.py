"""A whole commissioning: subject, steps, model, machine."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
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
NO_SEARCH = Tuned()
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
    tuned: Tuned = NO_SEARCH  # result of the search for gains
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
    before = {} if out is None else _store.read_steps(out, kind, asked)

    def kept(step: Step, found: Any) -> None:
        if out is not None:
            _store.keep(out, step, found, place.dt, asked)
        done(step.title)

    with Session(place.make(seed), place.dt) as session:
        stand = Stand(session, place.dt, place.pitch, ended, kind.place)
        work = Work(stand, options, before)
        procedure.perform(kind, work, lambda step, intent: ask(step.title, intent), kept)
        stage = _Modelled(place, work, kind.model(work))
        # Reckoned before anything moves again: what sinks by its weight sinks meanwhile.
        rested, tuned = stage.reckoned(done, ended)
        if kind.compare is not None and tuned.gains:
            tuned = stage.compared(rested, tuned, kind.compare, ask, kept)
        toml, tree, on, verified = stage.verified(rested, tuned, ask)
        if tuned.gains and not verified.met:
            # A stage may hum under gains of a search, though it arrived sooner by them before.
            found = f"{results.count_arrived(verified.moves)} of {verified.asked}"
            doubt = f"With the gains of the search {found} moves of the verification arrived"
            doubt += f" ({verified.fault})" if verified.fault else ""
            doubt += "; it was repeated with the gains of the rules."
            tuned = Tuned(doubts=(*tuned.doubts, doubt))
            stage.rest()
            toml, tree, on, verified = stage.verified(rested, tuned, ask)
        done(VERIFY)
        calibration = None
        if calibrate is not None and verified.met:
            calibration = calibrate(stage.machine, tree, (on,))
    robust = _margins(kind, tree, stage.model)
    return Commissioned(work, stage.model, toml, tree, verified, rested, robust, tuned, calibration)


def _check_known(place: Place) -> None:
    """Check the known values against the machine's file before any motion."""
    settings = machines.named(place.kind.name, "machine").settings
    known = {entry.path: entry for entry in entries(settings)}
    known["timing.period"].check(place.dt, f"--rig {printable(place.name, 200)}, dt")
    known["encoder.pitch"].check(place.pitch, "--pitch")


class _Modelled(NamedTuple):
    """A stage whose model was found, and the machines that follow from it."""

    place: Place
    work: Work
    model: Any

    @property
    def machine(self) -> machines.Machine:
        return machines.named(self.place.kind.name, "machine")

    def settings(
        self, rested: float | None, tuned: Tuned = NO_SEARCH, home: Any = None
    ) -> tuple[str, Any]:
        """The machine's file and settings with a tolerance and gains, if there are any."""
        kind = self.place.kind
        values = kind.settings(self.work, self.model, home)
        if rested is not None:
            values = {**values, TOLERANCE: f'"{rested!r} {kind.place.base}"'}
        values = {**values, **tuned.gains}
        toml, tree = self._file(values)
        fastest = self.work.options.speed
        if tree.guard.speed <= fastest:
            return toml, tree
        # Nothing is known of it at speeds that it was not allowed, and it is not allowed them now.
        unit, cruise = kind.place.named("m/s"), min(tree.motion.velocity, _CRUISE * fastest)
        slower = {"motion.velocity": cruise, "guard.speed": fastest}
        return self._file({**values, **{k: f'"{v!r} {unit}"' for k, v in slower.items()}})

    def _file(self, values: dict[str, str]) -> tuple[str, Any]:
        kind, name = self.place.kind, printable(self.place.name, 200)
        lines = [f"Found by commissioning {name} with macromicro {__version__}."]
        if procedure.sign(kind, self.work) < 0.0:
            lines.append(kind.turned)
        lines += ["", f"As found, in V and {kind.place.base}, with 95 % intervals:"]
        for quantity, one in kind.estimates(self.model).items():
            lines.append(f"  {quantity} = {one.value:.4g} +- {one.half:.2g} {one.unit}")
        return as_file(values, "\n".join([*lines, kind.head]), kind.name)

    def reckoned(
        self, done: Callable[[str], None], ended: Callable[[], bool]
    ) -> tuple[float | None, Tuned]:
        """Tolerance of the model, and gains that beat the rules' on it."""
        kind, tuned = self.place.kind, NO_SEARCH
        rested = None
        if kind.rehearse is not None:
            rested = kind.rehearse(self.machine, self.settings(None)[1])
        if kind.tune is not None:

            def progress(count: int, best: float) -> None:
                del count, best
                if ended():
                    raise KeyboardInterrupt

            tree = self.settings(rested)[1]
            try:
                tuned = kind.tune(tree, self.model, progress)
            except Exception as error:  # whatever a kind of the user's does
                tuned = Tuned(doubts=(_failure_note("A search for better gains failed", error),))
            done(TUNE)
        return rested, tuned

    def compared(
        self,
        rested: float | None,
        tuned: Tuned,
        compare: Callable[[Stand, Any, Any], tuple[float, str]],
        ask: Callable[[str, str], None],
        kept: Callable[[Step, Any], None],
    ) -> Tuned:
        """The searched gains, or none where the stage itself settles no faster."""
        kind, work = self.place.kind, self.work
        trees = [self.settings(rested, one)[1] for one in (NO_SEARCH, tuned)]
        # Gains may change how closely a stage rests: both are judged by what both can hold.
        within = max(float(tree.arrival.tolerance) for tree in trees)

        def tried(one: Tuned) -> tuple[float, str]:
            tree = self.settings(within, one, kind.home(work, self.model))[1]
            found = compare(work.stand, self.machine, tree)
            self.rest()  # what stops a run lets go of a weight, too
            return found

        found = work.found.get(_verifying.STEP.name)
        if found is None or found.gains != _verifying.gain_columns(tuned):
            ask(
                COMPARE,
                f"{kind.homing} and makes {len(_verifying.COMPARED_SHARES)} moves within its "
                "travel, with the gains of the rules and then with those of the search, "
                f"{_most(kind, trees[0])}.",
            )
            found = _verifying.compare(tried, tuned)
            kept(_verifying.STEP, found)
        return _verifying.faster(found, tuned)

    def verified(
        self, rested: float | None, tuned: Tuned, ask: Callable[[str, str], None]
    ) -> tuple[str, Any, Shifted, Verified]:
        """The machine's file, its settings, the rig with its zero, and the verification."""
        kind = self.place.kind
        tree = self.settings(rested, tuned)[1]
        what = f"makes {len(_verifying.SHARES)} moves within its travel with these gains"
        ask(VERIFY, f"{kind.homing} and {what}, {_most(kind, tree)}.")
        toml, tree = self.settings(rested, tuned, kind.home(self.work, self.model))
        on = Shifted(self.work.stand)
        return toml, tree, on, _verifying.verify(on, self.machine, tree)

    def rest(self) -> None:
        self.work.stand.rest(self.work.options.caution(self.work.options.creep))


def _most(kind: Kind, tree: Any) -> str:
    told = kind.place.told
    return (
        f"at up to {told(tree.motion.velocity, 'm/s', 3)}, "
        f"{told(tree.motion.acceleration, 'm/s^2', 3)} and {tree.guard.effort:.3g} V"
    )


def _margins(kind: Kind, tree: Any, model: Any) -> Robustness:
    """Robustness of the gains; a failure loses no results."""
    try:
        return kind.margins(tree, model)
    except Exception as error:  # whatever a kind of the user's does
        return Robustness(
            (), (_failure_note("The robustness of the gains could not be computed", error),)
        )


def _failure_note(what: str, error: Exception) -> str:
    """Note of a failed computation."""
    return f"{what} ({f'{type(error).__name__}: {error}'[:200]})."
