"""Settings of the live machine's process, clients and recording."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, Self

from macromicro import derived, rules
from macromicro.columns import Column
from macromicro.control import macro, outside
from macromicro.control.live.parameters import Live, SoftLimits
from macromicro.control.settings import Control
from macromicro.errors import InputError
from macromicro.nominal import PERIOD
from macromicro.plant.bench import Bench, Sensors
from macromicro.programme.travel import Travel
from macromicro.rig import limits
from macromicro.rig.limits import Limits
from macromicro.schema.config import as_toml, changed_toml
from macromicro.schema.par import Given, Par, entries
from macromicro.serve import telling
from macromicro.serve._programmes import TwoStage
from macromicro.serve.persist import identity
from macromicro.serve.shared import Telemetry, published
from macromicro.settings import chosen

CHOICE = "service choice"
STOP, HOLD, GO_ON = "stop", "hold", "go on"
AUTO, OFF = "auto", "off"
LEAST_LOOKS = 5  # periods within the shortest silence or wait that means anything


def _own(unit: str, meaning: str, **rest: Any) -> Par:
    """A parameter chosen for this server."""
    return Par(unit, meaning, CHOICE, **rest)


class ServeSettings(NamedTuple):
    """Table [serve] of a settings file."""

    parent_timeout: Annotated[
        float,
        _own(
            "s",
            "silence of the server after which the loop makes the outputs safe and ends",
            shown="ms",
            lo=0.1,
            hi=10.0,
        ),
    ] = 1.0
    loop_timeout: Annotated[
        float,
        _own(
            "s",
            "time without a period after which the loop process is ended and its rig stopped",
            shown="ms",
            lo=0.1,
            hi=10.0,
        ),
    ] = 0.5
    client_timeout: Annotated[
        float,
        _own(
            "s",
            "silence of the client that holds control after which it counts as lost",
            lo=0.2,
            hi=3600.0,
        ),
    ] = 5.0
    lost_client: Annotated[
        str,
        _own(
            "",
            "when that client is lost: decelerate (stop) or hold the position (hold)",
            choices=(STOP, HOLD),
        ),
    ] = STOP
    reply_timeout: Annotated[
        float,
        _own(
            "s",
            "time within which the loop must reach a request; after that it expires",
            lo=0.05,
            hi=60.0,
        ),
    ] = 1.0
    miss_share: Annotated[
        float,
        _own(
            "",
            "share of missed periods in the window above which the machine stops; 1 for never",
            positive=True,
            hi=1.0,
        ),
    ] = 0.1
    miss_window: Annotated[
        float, _own("s", "window in which missed periods are counted", lo=0.05, hi=60.0)
    ] = 1.0
    realtime: Annotated[
        str,
        _own(
            "",
            "real-time priority of the loop: where permitted (auto), or never (off)",
            choices=(AUTO, OFF),
        ),
    ] = AUTO
    priority: Annotated[
        int, _own("", "SCHED_FIFO priority of the loop, where permitted", lo=1, hi=90)
    ] = 50
    core: Annotated[
        int, _own("", "processor core that the loop is bound to; -1 for any", lo=-1, hi=4095)
    ] = -1
    recorder_failure: Annotated[
        str,
        _own(
            "",
            "when the recording cannot be written: go on without it, or stop the machine",
            choices=(GO_ON, STOP),
        ),
    ] = GO_ON
    recorder_capacity: Annotated[
        float,
        _own(
            "s",
            "time for which a recording's disk space is reserved first; doubled as needed",
            shown="min",
            lo=1.0,
            hi=86400.0,
        ),
    ] = 300.0


def patient(serve: ServeSettings) -> ServeSettings:
    """The same settings for a virtual machine, which may run late on a busy computer."""
    usual = ServeSettings()
    late = usual._replace(miss_share=1.0, loop_timeout=10.0, parent_timeout=10.0)
    told = {n: v for n, v in serve._asdict().items() if v != getattr(usual, n)}
    return late._replace(**told)


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


def kept(serve: ServeSettings, period: float, where: str) -> None:
    """Raise the first of these `problems`."""
    for name, value, accepted in problems(serve, period):
        raise InputError(f"{where}, {name}", value, accepted)


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
    def model(self) -> str:
        return "two-stage positioner"

    @property
    def names(self) -> dict[str, str]:
        return {stage: f"{stage}-stage" for stage in ("macro", "micro")}

    @property
    def efforts(self) -> dict[str, tuple[str, str]]:
        return {"macro": ("motor", "V"), "micro": ("CTRL", "V")}

    @property
    def limited(self) -> tuple[str, ...]:
        return telling.PARTS

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
        return published((self.live.place,), law=self.law_columns)

    @property
    def axes(self) -> tuple[tuple[str, Live], ...]:
        """The named stages of a machine of several."""
        return ()

    @property
    def trees(self) -> tuple[tuple[str, Any], ...]:
        """Settings of each stage that a calibration may correct, under its name."""
        return ()

    @property
    def plane(self) -> bool:
        """Whether two stages move in a plane."""
        return False

    @property
    def homing(self) -> tuple[int, ...]:
        """The stages whose position is known by homing, or the first."""
        return (0,)

    @property
    def speeds(self) -> dict[str, float]:
        """Maximum speeds of moves led by set points: none on this machine."""
        return {}

    @property
    def programmes(self) -> TwoStage:
        own = self.controller.macro_law not in macro.NAMES
        return TwoStage(self.live.pitch, rates=own)

    def tables(self, key: str) -> str:
        """Its tables as TOML: all of a file, or one parameter."""
        return as_toml(self, key)

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
        return changed_toml(self._replace(controller=control, live=live), LiveSettings())

    def derived(self) -> tuple[derived.Derivation, ...]:
        return derived.DERIVED + derived.of_law(self) + derived.LIVE

    def grown(self, table: Mapping[str, object], where: str) -> Self:
        return self._replace(controller=self.controller.grown(table, where))

    def together(self) -> list[rules.Problem]:
        found = [*problems(self.serve, self.period)]
        return found or [*rules.machine(self), *rules.live(self)]


def load(path: Path | None, law: str | None = None) -> LiveSettings:
    """The defaults, overridden by the TOML file at `path`, under `law`."""
    return chosen(LiveSettings(), path, law)
