"""A machine under its settings with a programme: how it is run, recorded and judged."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Self

import numpy as np

import macromicro
from macromicro.arrays import Array
from macromicro.batch.variants import Metric
from macromicro.columns import Column
from macromicro.kernel import cache_folder
from macromicro.place import LENGTH, Place
from macromicro.recording import Recording
from macromicro.recording_format import Attribute
from macromicro.rig.faults import end_attributes
from macromicro.rig.session import Fixture
from macromicro.runs import arrivals
from macromicro.runs.arrivals import Rest
from macromicro.schema import config
from macromicro.simulate import Outcome, Sink
from macromicro.uncertainty.table import Uncertain

Progress = Callable[[float, int], None]


class Blocks:
    """A sink in memory, of all rows or of some."""

    def __init__(self, rows: Sequence[int] | None = None) -> None:
        self.blocks: list[Array] = []
        self._rows = rows

    def append(self, block: Array) -> None:
        self.blocks.append(block if self._rows is None else block[self._rows])

    def all(self, columns: Sequence[Column]) -> Array:
        return np.concatenate([np.empty((len(columns), 0)), *self.blocks], axis=1)


class Done(NamedTuple):
    recording: Recording
    outcome: Outcome


class Setup:
    """A machine under its settings with a programme. Each family of machines has its own."""

    name: str  # of the machine
    default: Any  # settings that a file need not give
    settings: Any
    programme: Any
    title: str  # of the programme
    cycles: int = 1  # that the programme holds
    period: float  # of control, s
    expected: float  # usual duration of the programme, s
    attributes: dict[str, Attribute]  # of its recordings, beside those of all machines
    files: tuple[str, ...]  # that its run may write
    place: Place = LENGTH  # units of its arrivals
    remedy: str  # where moves do not arrive
    kernels: str  # name of the machine's loop in the compiler's cache
    usual: str = ""  # programme that runs where none is named; "": moves of the machine's own
    judged: tuple[str, ...] | None = None  # columns that `measured` reads; None: all

    def with_settings(self, settings: Any) -> Self:
        """The same moves under other settings."""
        raise NotImplementedError

    def as_toml(self) -> str:
        """All settings."""
        raise NotImplementedError

    def as_file(self) -> str:
        """Settings for `macromicro run --config`."""
        return self.as_toml()

    def uncertain(self, *, variants: bool = False) -> tuple[Uncertain, ...]:
        """Uncertain parameters; `variants`: also effects that no model has."""
        raise NotImplementedError

    def kept(self, drawn: Any) -> Any:
        """Settings that were drawn, with what stays as it is here."""
        return drawn

    @property
    def capacity(self) -> int:
        """Rows to reserve: the usual duration and a margin; the file grows if needed."""
        return round((1.05 * self.expected + 5.0) / self.period)

    def columns(self, on: Any = None) -> tuple[Column, ...]:
        """What a run records; of a rig only what it measures."""
        raise NotImplementedError

    def perform(
        self, sink: Sink, *, on: Any = None, seed: int = 0, progress: Progress | None = None
    ) -> Outcome:
        """Run the programme into a sink; `on` is what it runs on, None the simulated machine."""
        raise NotImplementedError

    def is_compiled(self) -> bool:
        """Whether the compiler's cache seems to hold such a machine already."""
        return any(cache_folder().rglob(f"{self.kernels}*.nbi"))

    def compile(self) -> None:
        """Compile the simulated machine, or load it from the cache."""
        raise NotImplementedError

    def runs_interpreted(self) -> bool:
        """Whether a run is over before the machine would be compiled, so that it does not wait."""
        raise NotImplementedError

    def source(self, rig: str, seed: int) -> Any:
        """What `--rig` names; None for the simulated machine."""
        raise NotImplementedError

    def open(self, source: Any, seed: int) -> Any:
        """What a run is `on`, from its source."""
        return source

    def intent(self, source: Any) -> list[str]:
        """What will move on the user's rig, how far and how hard."""
        raise NotImplementedError

    def notices(self, source: Any) -> list[str]:
        """Remarks before a run."""
        return []

    def describe(self, move: int) -> str:
        """A move in words, while it runs."""
        return f"move {move + 1}"

    def padded(self, recording: Recording) -> Recording:
        """A recording with NaN in channels that a rig lacks, which measures and figures skip."""
        return recording

    def results(self, recording: Recording) -> dict[str, Any]:
        """Results of its run: `moves`, and others that its reports show."""
        raise NotImplementedError

    def learned(self, recording: Recording) -> str | None:
        """A settings file of what the laws have learned in its run; None: nothing."""
        return None

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """What studies judge a run by."""
        raise NotImplementedError

    @property
    def main(self) -> tuple[str, ...]:
        """The metrics that are drawn, six at most."""
        raise NotImplementedError

    @property
    def limits(self) -> dict[str, tuple[float, str]]:
        """Limits of metrics, with their sources."""
        return {}

    def measured(self, recording: Recording, code: int) -> Sequence[float]:
        """The `metrics` of a run that a fault, by its code, or 0 ended."""
        raise NotImplementedError

    def rests(self, recording: Recording) -> list[Rest]:
        """How the moves of its run ended."""
        raise NotImplementedError

    def record(self, *, on: Any = None, seed: int = 0, warn: bool = False) -> Done:
        """The recording of a run in memory, with a warning of moves that did not arrive.

        If the guard stops the run, the recording ends there, its attribute `finished` is 0 and
        `fault` names the reason.
        """
        blocks, columns = Blocks(), self.columns(on)
        outcome = self.perform(blocks, on=on, seed=seed)
        attributes = self.about(seed) | end_attributes(outcome.finished, outcome.fault)
        if isinstance(on, Fixture):
            attributes["rig"] = on.name
        rows = blocks.all(columns)
        made = Recording.from_arrays(columns, rows, self.period, attributes)
        if warn:
            arrivals.warn(self.rests(made), self.remedy, self.place, stacklevel=4)
        return Done(made, outcome)

    def simulate(self, seed: int, names: Sequence[str] | None = None) -> tuple[Recording, Outcome]:
        """A simulated run with some of its columns and without attributes."""
        columns = self.columns()
        rows = [k for k, c in enumerate(columns) if names is None or c.name in names]
        kept, blocks = [columns[k] for k in rows], Blocks(None if names is None else rows)
        outcome = self.perform(blocks, seed=seed)
        return Recording.from_arrays(kept, blocks.all(kept), self.period, {}), outcome

    def trial(self, seed: int) -> Sequence[float]:
        """The `metrics` of a run."""
        recording, outcome = self.simulate(seed, self.judged)
        return self.measured(recording, outcome.watch.fault)

    def about(self, seed: int) -> dict[str, Attribute]:
        """Attributes of a recording."""
        return {
            "version": macromicro.__version__,
            "programme": self.title,
            "seed": seed,
            "cycles": self.cycles,
            **self.attributes,
            "overrides": json.dumps(overridden(self.settings, self.default)),
            "settings": self.as_toml(),
        }


def overridden(settings: Any, default: Any) -> dict[str, str]:
    """Parameters that differ from the defaults, as a person writes them, not as TOML does."""
    found = config.difference(settings, default)
    return {k: v[1:-1] if v[:1] == v[-1:] == '"' else v for k, v in found.items()}
