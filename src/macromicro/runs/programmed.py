"""A programme on the two-stage machine: the virtual bench, a rig, or recorded sensors.

The Hall sensor of a virtual bench is always calibrated on that bench.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from macromicro import hall_table, interpreting, loop, recorded, simulate
from macromicro import programme as programmes
from macromicro.batch import programme_metrics
from macromicro.batch.variants import Metric
from macromicro.columns import Column, whole
from macromicro.control import settings as control_settings
from macromicro.design import response
from macromicro.design.extension import extension, per_cycle
from macromicro.design.profiles import profiles
from macromicro.design.response import MoveResult
from macromicro.design.tracking import followed_stages, tracking
from macromicro.design.vibration import vibration
from macromicro.errors import ProblemError
from macromicro.kernel import compiled
from macromicro.lab import replay
from macromicro.lab.machine import FLAGS, approach, fill_gaps, follow, under, visible_columns
from macromicro.loop import PERIOD
from macromicro.programme import MACRO, MICRO, Programme
from macromicro.programme.travel import limits
from macromicro.recorded import COLUMNS
from macromicro.recording import Recording
from macromicro.rig.opening import TWIN, open_rig
from macromicro.rig.replay import SCHEME, Replay, open_recording
from macromicro.rig.session import BENCH, Fixture
from macromicro.rig.twin import CompiledTwin
from macromicro.runs import arrivals, folder, keeping
from macromicro.runs.arrivals import Rest
from macromicro.runs.setup import Done, Progress, Setup
from macromicro.schema import config
from macromicro.settings import Settings
from macromicro.simulate import Outcome, Sink
from macromicro.uncertainty import table
from macromicro.uncertainty.table import Uncertain

# What a programme runs on: the virtual bench of its settings, a rig, or a recording's sensors.
Place = Fixture | Recording | None


class TwoStageSetup(Setup):
    """The two-stage machine with a programme."""

    name, default, period, files = Settings().machine(), Settings(), PERIOD, folder.FILES
    metrics: tuple[Metric, ...] = programme_metrics.METRICS
    judged: tuple[str, ...] = programme_metrics.COLUMNS
    usual, kernels = "thesis", "loop.rollout"
    main = (
        *("macro_settling", "macro_overshoot", "micro_error", "contraction", "extension"),
        "vibration",
    )
    remedy = (
        "Try a longer hold, or gains for this machine (macromicro tune). "
        "macromicro.moves(run) shows how each move went."
    )

    def __init__(
        self, settings: Settings, programme: Programme, *, fan: bool = False, cycles: int = 1
    ) -> None:
        self.settings, self.programme, self.fan = settings, programme, fan
        self.title, self.cycles = programme.title, cycles
        self.attributes = {"fan": int(fan)}
        self.expected = simulate.expected_duration(settings, programme)

    def with_settings(self, settings: Settings) -> TwoStageSetup:
        return TwoStageSetup(settings, self.programme, fan=self.fan, cycles=self.cycles)

    @property
    def per_cycle(self) -> int:
        """Moves of a cycle."""
        return len(self.programme.target) // self.cycles

    def as_toml(self) -> str:
        return config.as_toml(self.settings)

    def as_file(self) -> str:
        return config.changed_toml(self.settings, self.default)

    def uncertain(self, *, variants: bool = False) -> tuple[Uncertain, ...]:
        return table.UNCERTAIN + table.VARIANTS if variants else table.UNCERTAIN

    @property
    def capacity(self) -> int:
        longest = simulate.longest(self.settings, self.programme)
        return min(round(longest / PERIOD), super().capacity)

    def columns(self, on: Place = None) -> tuple[Column, ...]:
        every = recorded.columns(control_settings.prepare(self.settings.controller))
        if on is None:
            return every
        return replay.columns(on) if isinstance(on, Recording) else visible_columns(on, every)

    def perform(
        self, sink: Sink, *, on: Place = None, seed: int = 0, progress: Progress | None = None
    ) -> Outcome:
        what, settings, fan = self.programme, self.settings, self.fan
        if on is None:
            how: Any = {"seed": seed, "fan": fan, "progress": progress}
            return simulate.simulate(settings, what, sink, **how)
        if isinstance(on, Recording):
            return replay.replay(on, what, settings, sink, fan=fan, progress=progress)
        return self._on_rig(on, sink, seed, progress)

    def _on_rig(
        self, fixture: Fixture, sink: Sink, seed: int, progress: Progress | None
    ) -> Outcome:
        """`perform` on a rig, from cold, the carriage at 0 counts."""
        what, settings = self.programme, self.settings
        check(fixture, what)
        own = fixture.calibrated() if np.any(what.stage == MICRO) else fixture.table
        control = control_settings.prepare(
            settings.controller, self.fan, own, settings.sensors.encoder.pitch
        )
        fixture = under(settings, fixture)
        filled = _Filled(sink, fixture, recorded.columns(control))
        longest = round(simulate.longest(settings, what) / PERIOD)
        began = time.perf_counter()
        with fixture.open(seed) as session:
            session.cold(fixture.rest)
            if fixture.has("encoder"):
                approach(fixture, session, 0.0)
            session.restart()
            outcome = follow(session, what, control, fixture.limits, filled, longest, progress)
        return outcome._replace(wall=time.perf_counter() - began)

    def compile(self) -> None:
        rolled = simulate.prepare(self.settings, self.programme, self.fan)
        if rolled.control.compiles:
            compiled(loop.rollout)(*simulate.arguments(rolled, 0))
        else:
            CompiledTwin(rolled.plant, 0)

    def runs_interpreted(self) -> bool:
        rolled = simulate.prepare(self.settings, self.programme, self.fan)
        periods, given = self.expected / self.period, simulate.arguments(rolled, 0)
        return rolled.control.compiles and interpreting.is_quicker(loop.rollout, periods, *given)

    def source(self, rig: str, seed: int) -> Place:
        if rig == TWIN:
            return None
        if rig.startswith(SCHEME):
            recording = open_recording(rig)
            Replay(recording, rig.removeprefix(SCHEME))  # has it sensors?
            return recording
        fixture = open_rig(rig, seed, limits=self.settings.guard, gains=self.settings.controller)
        check(fixture, self.programme)
        return fixture

    def intent(self, source: Place) -> list[str]:
        if not isinstance(source, Fixture):
            return []
        control, pitch = self.settings.controller, self.settings.sensors.encoder.pitch
        stage, target = self.programme.stage, self.programme.target
        lines = [f"{source.name}, {self.title or 'a programme'}, about {self.expected:.0f} s:"]
        if source.has("encoder"):
            limit = f"{control.motor_limit:g} V"
            lines.append(f"  first the macro-stage to 0 counts, at up to {limit}")
        for which, name, scale, limit in (
            (MACRO, "macro", 1e3 * pitch, f"motor up to {control.motor_limit:g} V"),
            (MICRO, "micro", 1e3, f"CTRL up to {control.ctrl_limit:g} V"),
        ):
            ways = target[stage == which] * scale
            if len(ways):
                reach = f"from {np.min(ways):.6g} to {np.max(ways):.6g} mm"
                lines.append(f"  {name}-stage: {len(ways)} set points {reach}, {limit}")
        return lines

    def notices(self, source: Place) -> list[str]:
        if isinstance(source, Fixture) or not hall_table.is_needed(self.settings):
            return []
        return ["another Hall sensor: calibrating it on this bench first"]

    def describe(self, move: int) -> str:
        """As "move 3 of 40: micro to 3 mm"; only the position within a profile."""
        programme = self.programme
        if not 0 <= move < len(programme.target):
            return ""
        macro = programme.stage[move] == MACRO
        pitch = self.settings.sensors.encoder.pitch if macro else 1.0
        millimetres = programme.target[move] * pitch * 1e3
        name = "macro" if macro else "micro"
        if programme.profiles and not (programme.mixed and programme.moves[move]):
            return f"{name} at {millimetres:.3f} mm"
        number, last = (int(programme.numbers[i]) for i in (move, -1))
        return f"move {number} of {last}: {name} to {millimetres:g} mm"

    def padded(self, recording: Recording) -> Recording:
        lacking = [c for c in COLUMNS if c.name not in recording and not c.name.startswith("true_")]
        if not lacking:
            return recording
        columns, nothing = (*recording.columns, *lacking), np.full(len(recording), np.nan)
        rows = [*(recording[c.name] for c in recording.columns), *[nothing] * len(lacking)]
        return Recording.from_arrays(
            columns, whole(np.array(rows), columns), recording.dt, recording.attributes
        )

    def results(self, recording: Recording) -> dict[str, Any]:
        what, pitch = self.programme, self.settings.sensors.encoder.pitch
        band = self.settings.controller.sequence.tolerance
        done = moves_of(recording, what, self.settings)
        first = [m for m in done if m.stage == "macro" and m.move < self.per_cycle]
        return {
            "moves": done,
            "tracking": tracking(recording, what, pitch=pitch),
            "vibration": [v for m in first if (v := vibration(recording, m)) is not None],
            "cycles": per_cycle(done, extension(recording), self.per_cycle),
            "begun": int(recording["move"][-1]) + 1 if len(recording) else 0,
            "profiles": tuple(profiles(recording, what, pitch=pitch, macro_band=band)),
        }

    def learned(self, recording: Recording) -> str | None:
        return keeping.text(recording, self.settings)

    def rests(self, recording: Recording) -> list[Rest]:
        done = moves_of(self.padded(recording), self.programme, self.settings)
        return arrivals.of_both(done, self.programme.numbers)

    def measured(self, recording: Recording, code: int) -> list[float]:
        row = programme_metrics.measure(recording, self.programme, self.settings, code)
        return [float(value) for value in row]


def load(path: Path, settings: Settings) -> Programme:
    return programmes.load(path, limits(settings.travel, settings.sensors.encoder.pitch))


def check(fixture: Fixture, programme: Programme) -> None:
    """Refuse a rig that a programme cannot run on."""
    if fixture.kind != BENCH:
        raise ProblemError(
            f"--rig {fixture.name}", f"a programme needs a bench, not a {fixture.kind}"
        )
    for stage, name, channel in ((MACRO, "macro", "encoder"), (MICRO, "micro", "hall")):
        if np.any(programme.stage == stage):
            fixture.need(f"a programme with {name} moves", channel)
    if np.any(programme.stage == MICRO):
        fixture.calibrated()


class _Filled:
    """A sink that passes on the columns that a rig fills, with flags in every row."""

    def __init__(self, sink: Sink, fixture: Fixture, every: tuple[Column, ...]) -> None:
        self._sink, self._names = sink, [c.name for c in every]
        self._shown = [self._names.index(c.name) for c in visible_columns(fixture, every)]
        self._flags = dict.fromkeys(FLAGS, 0.0)  # as they were last

    def append(self, block: npt.NDArray[np.float64]) -> None:
        rows = block.copy()
        for name, last in self._flags.items():
            row = self._names.index(name)
            rows[row] = fill_gaps(np.append(last, rows[row]))[1:]
            self._flags[name] = float(rows[row, -1])
        self._sink.append(rows[self._shown])


def moves_of(recording: Recording, programme: Programme, settings: Settings) -> list[MoveResult]:
    """Results of all moves, except of stages that follow a trajectory."""
    return response.moves(
        recording,
        programme,
        pitch=settings.sensors.encoder.pitch,
        macro_band=settings.controller.sequence.tolerance,
        but=followed_stages(recording, programme),
    )


class Runner(Protocol):
    """Runs a programme and returns its recording: the twin, or a real rig."""

    def __call__(
        self, programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
    ) -> Recording:
        """The recording of `programme` under `settings`."""


def record(
    programme: Programme,
    settings: Settings,
    *,
    on: Place = None,
    seed: int = 0,
    fan: bool = False,
    cycles: int = 1,
) -> Done:
    """A run in memory."""
    setup = TwoStageSetup(settings, programme.repeated(cycles), fan=fan, cycles=cycles)
    return setup.record(on=on, seed=seed)


def on_twin(
    programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
) -> Recording:
    return record(programme, settings, seed=seed, fan=fan).recording


def on_rig(fixture: Fixture) -> Runner:
    def run(
        programme: Programme, settings: Settings, seed: int = 0, fan: bool = False
    ) -> Recording:
        return record(programme, settings, on=fixture, seed=seed, fan=fan).recording

    return run
