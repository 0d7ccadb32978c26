"""A laboratory procedure of the thesis, and the lab it runs in."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from macromicro.drawing.exhibit import Drawn
from macromicro.drawing.files import DEFAULT
from macromicro.errors import ProblemError
from macromicro.settings import Settings
from macromicro.thesis.claims import Claim

if TYPE_CHECKING:
    from macromicro.lab.machine import Machine
    from macromicro.rig.session import Fixture
    from macromicro.runs.programmed import Runner
    from macromicro.thesis.cycle_bench import CycleBed
    from macromicro.thesis.kiln_bench import Kiln


class Needs(Protocol):
    """What `Lab.check` reads of a procedure."""

    @property
    def name(self) -> str:
        pass

    @property
    def channels(self) -> tuple[str, ...]:
        """Names of the channels that it needs."""


class Lab(NamedTuple):
    """Where procedures run: on `rigs`, or, without any, on the virtual benches of `settings`.

    Examples
    --------
    >>> from macromicro.thesis.procedure import Lab
    >>> round(Lab().bench().encoder.pitch * 1e6, 1)  # um, of the virtual bench
    71.4
    """

    settings: Settings = Settings()
    seed: int = 0
    rigs: tuple[Fixture, ...] = ()
    figures: tuple[str, ...] = DEFAULT

    def bench(self) -> Machine:
        """The two-stage bench.

        Returns
        -------
        Machine
            The first rig of that kind, or the virtual one.
        """
        from macromicro.lab.machine import under
        from macromicro.plant import bench

        if not self.rigs:
            return bench.prepare(self.settings.bench, self.settings.sensors)
        return under(self.settings, self.rig("bench"))

    def kiln(self) -> Kiln:
        """The kiln of Section 5.2.1, with the bench's actuator in it.

        Returns
        -------
        Kiln
            The first rig of that kind, or the virtual one.
        """
        from macromicro.thesis import kiln_bench

        if self.rigs:
            return self.rig("kiln")
        return kiln_bench.prepare(kiln_bench.with_bench(self.settings.bench))

    def cycle(self) -> CycleBed:
        """The cycle bench of Appendix D, with the bench's actuator on it.

        Returns
        -------
        CycleBed
            The first rig of that kind, or the virtual one.
        """
        from macromicro.thesis import cycle_bench

        if self.rigs:
            return self.rig("cycle")
        return cycle_bench.prepare(cycle_bench.with_bench(self.settings.bench))

    def runner(self) -> Runner:
        """What runs programmes on the two-stage bench.

        Returns
        -------
        Runner
            On the rig, or on the virtual bench.
        """
        from macromicro.runs.programmed import on_rig, on_twin

        return on_rig(self.rig("bench")) if self.rigs else on_twin

    def rig(self, kind: str) -> Fixture:
        """The first rig of a kind.

        Parameters
        ----------
        kind : str
            "bench", "kiln" or "cycle".

        Returns
        -------
        Fixture
            As it was given.

        Raises
        ------
        ProblemError
            There is none.
        """
        found = next((r for r in self.rigs if r.kind == kind), None)
        if found is None:
            there = ", ".join(f"{r.name} (a {r.kind})" for r in self.rigs)
            raise ProblemError(
                "--rig",
                f"no {kind} among {there}",
                f"Add a {kind} with one more --rig, or use the simulated machine alone.",
            )
        return found

    def check(self, procedure: Needs) -> None:
        """Refuse rigs that do not measure all that a procedure needs.

        Parameters
        ----------
        procedure : Needs
            Its name and channels.
        """
        if not self.rigs:
            return
        for kind, channels in needed(procedure.channels).items():
            self.rig(kind).need(f"the procedure {procedure.name}", *channels)


def needed(channels: tuple[str, ...]) -> dict[str, list[str]]:
    """A procedure's channels by the kind of rig.

    Parameters
    ----------
    channels : tuple[str, ...]
        "kiln.encoder" is the kiln's; names without a dot are the bench's.

    Returns
    -------
    dict[str, list[str]]
        Names without the kind.

    Examples
    --------
    >>> from macromicro.thesis.procedure import needed
    >>> needed(("laser", "hall", "kiln.encoder"))
    {'bench': ['laser', 'hall'], 'kiln': ['encoder']}
    """
    found: dict[str, list[str]] = {}
    for name in channels:
        kind, dot, channel = name.partition(".")
        found.setdefault(kind if dot else "bench", []).append(channel if dot else name)
    return found


class Procedure(NamedTuple):
    """One laboratory procedure.

    `collect` gives recordings; `claims` and the functions of `figures` take what it gave.

    Examples
    --------
    >>> from macromicro.thesis.procedure import Procedure
    >>> rest = Procedure("rest", "At rest", (), ("encoder",), (), {}, (), 1.0, dict, list)
    >>> rest.channels
    ('encoder',)
    """

    name: str
    title: str
    sections: tuple[str, ...]  #: of the thesis
    #: what rigs must measure: fields of `Sample` for the bench, "kiln.encoder" for the kiln
    channels: tuple[str, ...]
    ids: tuple[str, ...]  #: claims that it measures
    #: number of each figure and table, with the function that draws it
    figures: Mapping[str, Callable[[Any], Drawn]]
    diagrams: tuple[str, ...]  #: numbers of the diagrams that belong to it
    seconds: float  #: rough duration, for the order of work and the progress bar
    collect: Callable[[Lab], Any]
    claims: Callable[[Any], list[Claim]]
    #: claims that take no recording, for where `collect` fails
    arithmetic: Callable[[], list[Claim]] | None = None
