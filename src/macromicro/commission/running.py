"""A commissioning as a whole: what is commissioned, its steps, its model, its machine."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from macromicro import __version__
from macromicro.commission import procedure, store, verifying
from macromicro.commission import settings as found_settings
from macromicro.commission.model import Model
from macromicro.commission.probing import Ends
from macromicro.commission.procedure import Options, Step, Work
from macromicro.commission.stand import Stand
from macromicro.commission.verifying import Verified
from macromicro.machines import axis
from macromicro.machines import machine as machines
from macromicro.rig.session import Session
from macromicro.schema import config
from macromicro.schema.text import printable

VERIFY = "verification"
EXCHANGE = (
    "A positive effort made the encoder count down: exchange the motor's leads, or the encoder's "
    "channels A and B, before this file is used."
)


class Place(NamedTuple):
    """What is commissioned.

    Attributes
    ----------
    name : str
        For people.
    make : Callable[[int], Any]
        Gives the rig for a seed.
    dt : float
        Control period, s.
    pitch : float
        Travel per encoder count, m.
    effort : float
        Largest effort that its drive takes, V; NaN where nobody has said it.
    real : bool
        Whether something moves in the world.
    """

    name: str
    make: Callable[[int], Any]
    dt: float
    pitch: float
    effort: float
    real: bool

    def asked(self, options: Options) -> dict[str, Any]:
        """What a resumed session must share with the one that it resumes.

        Parameters
        ----------
        options : Options
            Of the session.

        Returns
        -------
        dict[str, Any]
            By name.
        """
        return {"of": self.name, "dt": self.dt, "pitch": self.pitch, **options._asdict()}


class Commissioned(NamedTuple):
    """What a commissioning found.

    Attributes
    ----------
    work : Work
        Each step's result.
    model : Model
        Of the strokes.
    toml : str
        The machine's file.
    settings : Any
        What it says, and what follows from it.
    verified : Verified
        How the machine's gains did on the axis.
    """

    work: Work
    model: Model
    toml: str
    settings: Any
    verified: Verified


def commission(
    place: Place,
    options: Options,
    out: Path | None = None,
    *,
    seed: int = 0,
    ask: Callable[[str, str], None] = lambda title, intent: None,
    done: Callable[[str], None] = lambda title: None,
    ended: Callable[[], bool] = lambda: False,
) -> Commissioned:
    """Commission an axis.

    Parameters
    ----------
    place : Place
        The axis.
    options : Options
        What may be done.
    out : Path | None, optional
        Folder that exists: what steps find is kept there, and what is there is not done again.
    seed : int, optional
        Given to the rig.
    ask : Callable[[str, str], None], optional
        Called before each step that moves, with its title and what it will do; may raise.
    done : Callable[[str], None], optional
        Called after each, with its title.
    ended : Callable[[], bool], optional
        Whether somebody wants it to end; asked each period.

    Returns
    -------
    Commissioned
        Model, machine, verification.

    Raises
    ------
    InputError
        An option, or what is kept in `out`, is not accepted.
    CommissionError
        A step cannot do its work; says why.
    KeyboardInterrupt
        Somebody wanted it to end; all outputs are safe, and completed steps are kept.
    """
    options = options.checked()
    asked = place.asked(options)
    before = {} if out is None else store.read(out, asked)

    def kept(step: Step, found: Any) -> None:
        if out is not None:
            store.keep(out, step.name, found, place.dt, asked)
        done(step.title)

    with Session(place.make(seed), place.dt) as session:
        work = Work(Stand(session, place.dt, place.pitch, ended), options, before)
        procedure.perform(work, lambda step, intent: ask(step.title, intent), kept)
        model = work.fitted()
        machine = machines.named("axis", "machine")
        assert machine is not None
        first = _settings(place, work, model, work.ends)[1]
        motion, effort = first.motion, first.controller.limit
        ask(
            VERIFY,
            f"The axis creeps to its low end and makes {len(verifying.SHARES)} moves within its "
            f"travel by the gains found, at up to {motion.velocity:.3g} m/s, "
            f"{motion.acceleration:.3g} m/s^2 and {effort:.3g} V.",
        )
        creep = options.caution(options.creep)
        ends = verifying.home(work.stand, work.direction, work.ends, creep)
        toml, tree = _settings(place, work, model, ends)
        verified = verifying.verify(work.stand, machine, tree)
        done(VERIFY)
    return Commissioned(work, model, toml, tree, verified)


def _settings(place: Place, work: Work, model: Model, ends: Ends) -> tuple[str, Any]:
    """The machine's file, and what it says."""
    values = found_settings.settings(model, work, ends, place.pitch)
    toml = found_settings.as_toml(values, model, _head(place, work))
    table = tomllib.loads(toml)
    table.pop(config.MACHINE)
    return toml, config.overridden(axis.DEFAULT, table, "the machine that was found")


def _head(place: Place, work: Work) -> str:
    lines = [f"Found by commissioning {printable(place.name, 200)} with macromicro {__version__}."]
    if work.direction.sign < 0.0:
        lines.append(EXCHANGE)
    return "\n".join(lines)
