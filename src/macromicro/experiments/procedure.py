"""What a laboratory procedure of the thesis consists of, and the lab it runs in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from macromicro.drawing.exhibit import Drawn
from macromicro.experiments.claim import Claim
from macromicro.settings import Settings

if TYPE_CHECKING:
    from macromicro.plant.bench import Plant
    from macromicro.plant.cycle import CyclePlant
    from macromicro.plant.kiln import KilnPlant


class Lab(NamedTuple):
    """Where procedures run: by default the virtual benches of `settings`, noise from `seed`."""

    settings: Settings = Settings()
    seed: int = 0

    def bench(self) -> Plant:
        """The two-stage bench."""
        from macromicro.plant import bench

        return bench.prepare(self.settings.bench, self.settings.sensors)

    def kiln(self) -> KilnPlant:
        """The kiln of Section 5.2.1."""
        from macromicro.plant import kiln

        return kiln.prepare(kiln.KilnBench())

    def cycle(self) -> CyclePlant:
        """The cycle bench of Appendix D."""
        from macromicro.plant import cycle

        return cycle.prepare(cycle.CycleBench())


class Procedure(NamedTuple):
    """One laboratory procedure.

    `sections`: of the thesis; `channels`: what it needs of a rig, none for arithmetic;
    `ids`: the claims that it measures; `figures`: numbers of the figures and tables that
    `draw` yields; `diagrams`: numbers of the diagrams that belong to it; `seconds`: roughly
    how long it takes, for the order of work and the progress bar.

    `collect` gives recordings, `claims` and `draw` take what it gave.
    """

    name: str
    title: str
    sections: tuple[str, ...]
    channels: tuple[str, ...]
    ids: tuple[str, ...]
    figures: tuple[str, ...]
    diagrams: tuple[str, ...]
    seconds: float
    collect: Callable[[Lab], Any]
    claims: Callable[[Any], list[Claim]]
    draw: Callable[[Any], Iterator[Drawn]]
