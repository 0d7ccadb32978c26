"""Settings of a served machine, its process, clients and recording."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

from macromicro import derived, rules
from macromicro.columns import Column
from macromicro.control import macro, outside
from macromicro.control.live.messages import MACRO, MICRO, STAGES
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.control.settings import Control
from macromicro.errors import InputError, ProblemError
from macromicro.machines import composite, compositions, on_rig, pace
from macromicro.machines.composite import AnyMachine, Composite
from macromicro.machines.machine import KEY, Machine
from macromicro.machines.machine import as_toml as machine_as_toml
from macromicro.machines.period import law_columns
from macromicro.machines.tree import live_gains, with_law, with_live_gains
from macromicro.nominal import PERIOD
from macromicro.plant.bench import Bench, Sensors
from macromicro.programme.travel import Travel
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.rig.opening import TWIN
from macromicro.schema import config
from macromicro.schema.par import Given, Par, entries
from macromicro.schema.text import printable, read_toml
from macromicro.serve import telling
from macromicro.serve._programmes import OneStage, Programmes, SeveralStages, TwoStage
from macromicro.serve.persist import identity
from macromicro.serve.shared import Telemetry, telemetry_of
from macromicro.serve.stage import guide
from macromicro.settings import choose

CHOICE = "service choice"
STOP, HOLD, GO_ON = "stop", "hold", "go on"
AUTO, OFF = "auto", "off"
LEAST_LOOKS = 5  # periods within the shortest silence or wait that means anything


def _server_par(unit: str, meaning: str, **rest: Any) -> Par:
    """A parameter chosen for this server."""
    return Par(unit, meaning, CHOICE, **rest)


class ServeSettings(NamedTuple):
    """Table [serve] of a settings file."""

    parent_timeout: Annotated[
        float,
        _server_par(
            "s",
            "silence of the server after which the loop makes the outputs safe and ends",
            shown="ms",
            lo=0.1,
            hi=10.0,
        ),
    ] = 1.0
    loop_timeout: Annotated[
        float,
        _server_par(
            "s",
            "time without a period after which the loop process is ended and its rig stopped",
            shown="ms",
            lo=0.1,
            hi=10.0,
        ),
    ] = 0.5
    client_timeout: Annotated[
        float,
        _server_par(
            "s",
            "silence of the client that holds control after which it counts as lost",
            lo=0.2,
            hi=3600.0,
        ),
    ] = 5.0
    lost_client: Annotated[
        str,
        _server_par(
            "",
            "when that client is lost: decelerate (stop) or hold the position (hold)",
            choices=(STOP, HOLD),
        ),
    ] = STOP
    reply_timeout: Annotated[
        float,
        _server_par(
            "s",
            "time within which the loop must reach a request; after that it expires",
            lo=0.05,
            hi=60.0,
        ),
    ] = 1.0
    miss_share: Annotated[
        float,
        _server_par(
            "",
            "share of missed periods in the window above which the machine stops; 1: never, the "
            "default of a twin",
            positive=True,
            hi=1.0,
        ),
    ] = 0.1
    miss_window: Annotated[
        float, _server_par("s", "window in which missed periods are counted", lo=0.05, hi=60.0)
    ] = 1.0
    realtime: Annotated[
        str,
        _server_par(
            "",
            "real-time priority of the loop: where permitted (auto), or never (off)",
            choices=(AUTO, OFF),
        ),
    ] = AUTO
    priority: Annotated[
        int, _server_par("", "SCHED_FIFO priority of the loop, where permitted", lo=1, hi=90)
    ] = 50
    core: Annotated[
        int, _server_par("", "processor core that the loop is bound to; -1 for any", lo=-1, hi=4095)
    ] = -1
    recorder_failure: Annotated[
        str,
        _server_par(
            "",
            "when the recording cannot be written: go on without it, or stop the machine",
            choices=(GO_ON, STOP),
        ),
    ] = GO_ON
    recorder_capacity: Annotated[
        float,
        _server_par(
            "s",
            "time for which a recording's disk space is reserved first; doubled as needed",
            shown="min",
            lo=1.0,
            hi=86400.0,
        ),
    ] = 300.0


_LATE: dict[str, Any] = {"miss_share": 1.0, "loop_timeout": 10.0, "parent_timeout": 10.0}


def allow_missed_periods(serve: ServeSettings) -> ServeSettings:
    """The same settings for a virtual machine: periods that a busy computer misses hurt nothing."""
    return _unless_set(serve, "miss_share")


def patient(serve: ServeSettings) -> ServeSettings:
    """The same for one that serves a program alone, whose processes may pause as well."""
    return _unless_set(serve, *_LATE)


def _unless_set(serve: ServeSettings, *names: str) -> ServeSettings:
    usual = ServeSettings()
    unset = [name for name in names if getattr(serve, name) == getattr(usual, name)]
    return serve._replace(**{name: _LATE[name] for name in unset})


def problems(serve: ServeSettings, period: float) -> Iterator[rules.Problem]:
    """Limits that a healthy loop of this period would violate."""
    told, least = f"at a period of {1e3 * period:.4g} ms", LEAST_LOOKS * period
    if serve.miss_share * round(serve.miss_window / period) < 1.0:
        yield "serve.miss_share", serve.miss_share, f"at least one period of the window, {told}"
    for name in ("loop_timeout", "parent_timeout", "reply_timeout"):
        value = getattr(serve, name)
        if value < least * (1.0 - 1e-9):
            accepted = f"{1e3 * least:.4g} ms or more, {LEAST_LOOKS} periods {told}"
            yield f"serve.{name}", f"{1e3 * value:.4g} ms", accepted


def require(serve: ServeSettings, period: float, where: str) -> None:
    """Raise the first of these `problems`."""
    for name, value, accepted in problems(serve, period):
        raise InputError(f"{where}, {name}", value, accepted)


class Facts(NamedTuple):
    """What the server tells clients of a machine."""

    model: str
    names: dict[str, str]  # of its stages, for people
    efforts: dict[str, tuple[str, str]]  # of each stage: its name and unit
    limited: tuple[str, ...]  # what has soft limits that clients may change
    speeds: dict[str, float]  # greatest speeds of moves led by set points, m/s
    plane: bool = False  # whether two stages move in a plane


_TWO_STAGE = Facts(
    "two-stage positioner",
    {stage: f"{stage}-stage" for stage in STAGES},
    {MACRO: ("motor", "V"), MICRO: ("CTRL", "V")},
    telling.PARTS,
    {},
)
_OF_POSITION = ("bench.carriage.", "sensors.encoder.", "live.pitch", "live.homing.")


class LiveSettings(NamedTuple):
    """Settings of the live two-stage machine: `Settings`, [live], [serve], a stricter guard."""

    bench: Bench = Bench()
    sensors: Sensors = Sensors()
    controller: Control = Control()
    guard: Limits = limits.LIVE
    travel: Travel = Travel()
    live: Live = Live()
    serve: ServeSettings = ServeSettings()
    given: Given = Given()

    def machine(self) -> str:
        return "two_stage"

    @property
    def facts(self) -> Facts:
        return _TWO_STAGE

    @property
    def period(self) -> float:
        return PERIOD

    @property
    def law_columns(self) -> tuple[Column, ...]:
        name = self.controller.macro_law
        if name in macro.NAMES:
            return ()
        outside.find(name, "controller.macro_law")  # the loop's process has not looked for it yet
        return outside.columns((self.controller.own,))

    @property
    def telemetry(self) -> Telemetry:
        return telemetry_of((self.live.place,), law=self.law_columns)

    @property
    def axes(self) -> tuple[tuple[str, Live], ...]:
        """The named stages of a machine of several."""
        return ()

    @property
    def trees(self) -> tuple[tuple[str, Any], ...]:
        """Settings of each stage that a calibration may correct, under its name."""
        return ()

    @property
    def homing(self) -> tuple[int, ...]:
        """The stages whose position is known by homing, or the first."""
        return (0,)

    @property
    def programmes(self) -> TwoStage:
        own = self.controller.macro_law not in macro.NAMES
        return TwoStage(self.live.pitch, rates=own)

    def tables(self, key: str) -> str:
        """Its tables as TOML: all of a file, or one parameter."""
        return config.as_toml(self, key)

    def kept_as(self, rig: str) -> str:
        """The machine's identity in the position file."""
        known = {e.path: e.value for e in entries(self) if e.path.startswith(_OF_POSITION)}
        return identity(rig, self.machine(), known)

    def rigs(self, name: str) -> tuple[str, ...]:
        return (name,)

    def place(self, rig: str) -> str:
        """Default name of its position file."""
        return rig

    def as_toml(self, control: Control, limits: SoftLimits) -> str:
        """A file for `--config` with the gains and soft limits in force."""
        live = self.live._replace(limits=limits)
        return config.changed_toml(self._replace(controller=control, live=live), LiveSettings())

    def derived(self) -> tuple[derived.Derivation, ...]:
        return derived.DERIVED + derived.of_law(self) + derived.LIVE

    def grown(self, table: Mapping[str, object], where: str) -> Self:
        return self._replace(controller=self.controller.grown(table, where))

    def together(self) -> list[rules.Problem]:
        found = [*problems(self.serve, self.period)]
        return found or [*rules.machine(self), *rules.live(self)]


_SERVE = "serve"
_LONGEST = 12  # letters of a word of SCPI, whose short form is the first four
# Words of the protocols where the name of a stage may stand.
_TAKEN = (
    *(*STAGES, "whole", "both", "all"),
    *("do", "id", "unit", "replace", "wait"),
    *("absolute", "relative", "number", "outcome", "point", "trust"),
)
_NOT_OF_POSITION = ("law", "controller", "own", "motion", "arrival", "guard")


class _Own(NamedTuple):
    """The server's tables in a machine's file."""

    serve: ServeSettings = ServeSettings()


class StageSettings(NamedTuple):
    """Settings of a served machine of one stage, or of several that have names."""

    model: str
    described: str | dict[str, Any]  # the machine, as its file names or describes it
    whole: AnyMachine  # that machine, whatever laws and lines the settings choose
    tree: Any
    lives: tuple[Live, ...]
    serve: ServeSettings = ServeSettings()
    guard: Limits = limits.LIVE  # of wires, which it has none of

    def __reduce__(self) -> Any:
        """For the loop's process: a tree of stages has a type of its own, made from them."""
        parts = (self.model, self.described, self.tree._asdict(), self.lives, self.serve)
        return _make, parts

    @property
    def several(self) -> bool:
        return isinstance(self.whole, Composite)

    @property
    def stages(self) -> tuple[str, ...]:
        """Their names; "" of an only one."""
        return composite.names(self.whole)

    @property
    def machine(self) -> Any:
        return composite.under(self.whole, self.tree)

    @property
    def axes(self) -> tuple[tuple[str, Live], ...]:
        """The named stages."""
        return tuple(zip(self.stages, self.lives, strict=True)) if self.several else ()

    @property
    def trees(self) -> tuple[tuple[str, Any], ...]:
        """The settings of each stage, under its name."""
        return tuple(zip(self.stages, self.whole.trees(self.tree), strict=True))

    @property
    def live(self) -> Live:
        return self.lives[0]

    @property
    def controller(self) -> Any:
        """Gains of the law for clients; of several laws by stage."""
        each = [live_gains(own) for _, own in self.trees]
        return _gains_of(self.stages)(*each) if self.several else each[0]

    @property
    def facts(self) -> Facts:
        names = {name: f"axis {name}" for name in self.stages}
        if not self.several:
            name = self.whole.name.rpartition(":")[2].lower()  # MODULE:MACHINE of another package
            names = {MACRO: "rotary axis" if name == "rotary" else name}
        speeds = (own.motion.velocity for _, own in self.trees)
        return Facts(
            self.model,
            names,
            dict.fromkeys(names, ("effort", "V")),
            ("whole",),
            dict(zip(names, speeds, strict=True)),
            isinstance(self.whole, Composite) and self.whole.has_plane,
        )

    @property
    def period(self) -> float:
        return pace.period(self.trees[0][1])

    @property
    def law_columns(self) -> tuple[Column, ...]:
        return law_columns(composite.stages(self.machine))

    @property
    def telemetry(self) -> Telemetry:
        places = tuple(live.place for live in self.lives)
        return telemetry_of(places, self.stages, self.law_columns)

    @property
    def homing(self) -> tuple[int, ...]:
        """The stages whose position is known by homing, or the first."""
        each = zip(self.machine.stages, self.trees, strict=True)
        found = (k for k, ((_, one), (_, own)) in enumerate(each) if guide.guide(one, own).touch)
        return tuple(found) or (0,)

    @property
    def programmes(self) -> Programmes:
        if self.several:
            return SeveralStages(self.machine, self.tree)
        return OneStage(self.tree)

    def tables(self, key: str) -> str:
        """Its table [serve] as TOML, or one parameter."""
        return config.as_toml(_Own(self.serve), key)

    def kept_as(self, rig: str) -> str:
        """The machine's identity in the position file."""
        known: dict[str, Any] = {}
        for (_, one), (name, tree) in zip(self.machine.stages, self.trees, strict=True):
            known |= _of_position(one, tree, f"{name}." if name else "")
        return identity(rig, self.whole.name, known)

    def rigs(self, name: str) -> tuple[str, ...]:
        if self.several and name != TWIN:
            return tuple(on_rig.rig_names(name, self.stages))
        return (name,)

    def place(self, rig: str) -> str:
        """Default name of its position file."""
        return f"{rig}-{self.whole.name}"

    def as_toml(self, control: Any, limits: SoftLimits) -> str:
        """A file for `--config` with the gains in force, and the soft limits of an only stage."""
        if not self.several:
            travel = self.tree.travel._replace(low=limits.whole_low, high=limits.whole_high)
            tree = with_live_gains(self.tree, control)
            return machine_as_toml(self.machine, tree._replace(travel=travel))
        each = zip(self.trees, control, strict=True)
        made = {name: with_live_gains(tree, law) for (name, tree), law in each}
        return machine_as_toml(self.machine, self.tree._replace(**made))


@cache
def _gains_of(stages: tuple[str, ...]) -> Any:
    """A parameter set with the gains of each stage under its name."""
    made: Any = type("Gains", (namedtuple("Gains", stages),), {"__slots__": ()})
    made.__annotations__ = dict.fromkeys(stages, Any)
    return made


def _of_position(machine: Machine, tree: Any, where: str) -> dict[str, Any]:
    """The settings that the position of a stage depends on."""
    known = {
        where + e.path: e.value
        for e in entries(tree)
        if e.path.partition(".")[0] not in _NOT_OF_POSITION
    }
    touch = None if machine.touch is None else machine.touch(tree)
    return known if touch is None else known | {f"{where}place": touch.place}


AnySettings = LiveSettings | StageSettings


def load(path: Path | None, law: str | None = None) -> AnySettings:
    """The settings of the machine that the file names; without a file the two-stage machine's."""
    if path is None or compositions.is_two_stage(path):
        return choose(LiveSettings(), path, law)
    return _stages(path, law)


def _stages(path: Path, law: str | None) -> StageSettings:
    """Read the settings of a machine, for a period that the server can keep."""
    file, table = printable(path, 300), config.table(path)
    described: Any = read_toml(path, config.WHAT)[KEY]
    whole = compositions.machine(described, f"{file}, {KEY}")
    if isinstance(whole, Composite):
        composite.refuse_law(law, composite.names(whole))
    del table[KEY]
    own = {_SERVE: table.pop(_SERVE)} if _SERVE in table else {}
    serve = config.overridden(_Own(), own, file).serve if own else ServeSettings()
    tree = whole.settings if law is None else with_law(whole.settings, law, "--law")
    tree = config.overridden(tree, table, file) if table else tree
    if law is not None:  # the option goes before the file's word
        tree = with_law(tree, law, "--law")
    machine = composite.under(whole, tree)
    if isinstance(whole, Composite):
        _require_servable(machine, file)
    trees = whole.trees(tree)
    require(serve, pace.period(trees[0]), file)
    stages = zip(machine.stages, trees, strict=True)
    lives = tuple(guide.live(one, own) for (_, one), own in stages)
    model = f"{machine.name} {printable(Path(path).stem, 60)}".replace(",", " ")
    return StageSettings(model, described, whole, tree, lives, serve)


def _make(
    model: str,
    described: str | dict[str, Any],
    parts: dict[str, Any],
    lives: tuple[Live, ...],
    serve: ServeSettings,
) -> StageSettings:
    whole = compositions.machine(described, KEY)
    tree = whole.settings._replace(**parts)
    return StageSettings(model, described, whole, tree, lives, serve)


def _require_servable(machine: Composite, file: str) -> None:
    """Refuse a machine whose stages clients cannot name, or cannot put in one unit."""
    known = [word[:4] for word in _TAKEN]
    for name in composite.names(machine):
        if name[:4] in known or not name.isalpha() or len(name) > _LONGEST:
            problem = f"clients cannot tell the stage {name} from other words"
            remedy = (
                f"Give it another name of {_LONGEST} letters at most, whose first four are those "
                f"of no other stage and none of {', '.join(_TAKEN)}."
            )
            raise ProblemError(f"{file}, machine", problem, remedy)
        known.append(name[:4])
    if len(set(composite.places(machine))) > 1:
        problem = "some stages turn and others slide, and clients use one unit"
        remedy = "Serve one stage: `macromicro config show --axis NAME` prints its file."
        raise ProblemError(f"{file}, machine", problem, remedy)
