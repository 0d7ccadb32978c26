"""The kernels of a kind of stage, what controls it, and its open loop."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from macromicro import arrays, joining
from macromicro.arrays import Array
from macromicro.control.stage_law import StageLaw
from macromicro.kernel import compiled, is_kernel
from macromicro.machines import lines as guarded_lines
from macromicro.machines.guarding import Limits
from macromicro.machines.lines import Wired
from macromicro.machines.sequence import Arrival, Plan
from macromicro.machines.signals import Sample
from macromicro.place import LENGTH, Place
from macromicro.types import Lines


class Kind(NamedTuple):
    """The kernels of one kind of stage; efforts are V at the D/A, positions m, or rad of a stage
    that turns.

    Examples
    --------
    >>> from macromicro.machines import piezo
    >>> piezo.KIND.name, piezo.KIND.noises, piezo.KIND.place.unit
    ('piezo', 1, 'mm')
    """

    name: str  #: for people
    noises: int  #: standard normal draws a period
    #: what only the simulated stage knows: a ``NamedTuple`` of floats, annotated with `Quantity`;
    #: the first field is the true position in m
    truth: Any
    prepare: Callable[[Any], Any]  #: from the machine's settings to the runtime parameters
    initial: Callable[[Any], Any]  #: from these to the state at the start: at rest at 0
    #: kernel: from parameters, state, time (s), draws and their row to what the stage shows
    measure: Callable[[Any, Any, float, Array, int], Sample]
    #: kernel: from parameters, state, effort (V), draws, their row and the period (s) to the state
    #: a period later
    advance: Callable[[Any, Any, float, Array, int, float], Any]
    show: Callable[[Any, Any], Any]  #: kernel: from parameters and state to the truth
    #: which of `types.Lines` it has, and "enable" if its drive has an enable line
    lines: tuple[str, ...] = ()
    #: kernel: from parameters and state to what these say, after `measure`
    sense: Callable[[Any, Any], Lines] = guarded_lines.none
    #: kernel: from parameters, state and the enable output (0 or 1) to the state with it
    switch: Callable[[Any, Any, float], Any] = guarded_lines.as_it_is
    place: Place = LENGTH  #: what its places are counted in
    corrected: bool = False  #: whether a calibration corrects it (`control.correction`)


class Loop(NamedTuple):
    """What controls a stage: runtime parameters."""

    gains: Any  #: of the law
    guard: Limits
    arrival: Arrival  #: when a move has arrived
    plan: Plan  #: the programme
    wired: Wired = Wired()  #: of the guard, for a stage with lines
    correction: Any = ()  #: `correction.Tables`, of a corrected stage


def watching(kind: Kind) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """The guard of the lines of a kind of stage.

    Parameters
    ----------
    kind : Kind
        Kind of stage.

    Returns
    -------
    step, bounded : Callable
        Kernels of `machines.lines`.

    Examples
    --------
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import watching
    >>> step, bounded = watching(piezo.KIND)
    >>> step.__name__
    'unwatched'
    """
    if kind.lines:
        return guarded_lines.step, guarded_lines.bounded
    return guarded_lines.unwatched, guarded_lines.unbounded


def kernels_of(kind: Kind) -> tuple[str, ...]:
    """Which fields of a kind of stage are kernels of its own.

    Parameters
    ----------
    kind : Kind
        Kind of stage.

    Returns
    -------
    tuple[str, ...]
        Names.

    Examples
    --------
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import kernels_of
    >>> kernels_of(piezo.KIND)
    ('measure', 'advance', 'show')
    """
    names = ("measure", "advance", "show")
    return (*names, "sense", "switch") if kind.lines else names


def compiles(law: StageLaw) -> bool:
    """Whether the loop of a stage under this law can be compiled.

    Parameters
    ----------
    law : StageLaw
        That controls the stage.

    Returns
    -------
    bool
        True if its `step` and `tell` are kernels.

    Examples
    --------
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import compiles
    >>> compiles(piezo.LAW), compiles(piezo.LAW._replace(step=lambda *values: values))
    (True, False)
    """
    return is_kernel(law.step) and is_kernel(law.tell)


def switching(kind: Kind) -> Callable[[Any, Any, float], Any]:
    """The enable line of a kind of stage, as fast as it can run.

    Parameters
    ----------
    kind : Kind
        Kind of stage.

    Returns
    -------
    Callable
        Its `switch`, compiled if it has lines.

    Examples
    --------
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import switching
    >>> switching(piezo.KIND) is piezo.KIND.switch  # it has no lines
    True
    """
    return compiled(kind.switch) if kind.lines else kind.switch


@lru_cache(maxsize=64)
def quick(kind: Kind) -> Kind:
    """A kind of stage whose kernels are compiled each: for a loop that runs interpreted, under a
    law that is plain Python.

    Parameters
    ----------
    kind : Kind
        Kind of stage.

    Returns
    -------
    Kind
        With the same results.

    Examples
    --------
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import quick
    >>> quick(piezo.KIND).name
    'piezo'
    """
    kernels: dict[str, Any] = {name: getattr(kind, name) for name in kernels_of(kind)}
    joining.join(*kernels.values())
    made: dict[str, Any] = {name: compiled(each) for name, each in kernels.items()}
    return kind._replace(**made)


class Bounds(NamedTuple):
    """Where an open-loop drive is ended.

    Examples
    --------
    >>> from macromicro.machines.stage import Bounds
    >>> Bounds(low=0.0, high=1e-4, speed=0.1).window  # s; m, m, m/s
    0.01
    """

    #: low, high: positions that it may not leave, m
    low: float
    high: float
    speed: float  #: greatest speed over `window`, m/s
    window: float = 0.01  #: s


class Driven(NamedTuple):
    """What an open-loop drive showed, up to its end or to the bound that it met."""

    t: Array  #: s
    effort: Array  #: V at the D/A; written at `t`, after the reading
    position: Array  #: as measured, m
    state: Any  #: the stage's at the end; 0 V from here on
    ended: str  #: "" for all efforts, or the bound: "low", "high", "speed"


_ENDED = ("", "low", "high", "speed")


@lru_cache(maxsize=64)
def opened(kind: Kind) -> Callable[..., tuple[Any, int, int]]:
    """The open loop of a kind of stage.

    Parameters
    ----------
    kind : Kind
        Kind of stage.

    Returns
    -------
    Callable
        ``run(params, stage, bounds, efforts, noise, out, dt) -> (stage, written, why)``, with `out`
        of shape (2, n) for time and position and `why` an index of what ended it.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import Bounds, opened
    >>> params, bounds = piezo.KIND.prepare(piezo.DEFAULT), Bounds(-1.0, 1.0, 1.0)  # m, m, m/s
    >>> noise, out = np.zeros((3, piezo.KIND.noises)), np.zeros((2, 3))
    >>> start = piezo.KIND.initial(params)
    >>> opened(piezo.KIND)(params, start, bounds, np.ones(3), noise, out, 0.001)[1:]
    (3, 0)
    """
    measure, advance = kind.measure, kind.advance
    joining.join(measure, advance)

    def run(
        params: Any, stage: Any, bounds: Bounds, efforts: Array, noise: Array, out: Array, dt: float
    ) -> tuple[Any, int, int]:
        behind = max(round(bounds.window / dt), 1)
        written, why = 0, 0
        for k in range(efforts.shape[0]):
            sample = measure(params, stage, k * dt, noise, k)
            out[0, k] = sample.t
            out[1, k] = sample.position
            written += 1
            if sample.position < bounds.low:
                why = 1
            elif sample.position > bounds.high:
                why = 2
            elif k >= behind:
                speed = abs(sample.position - out[1, k - behind]) / (behind * dt)
                if speed > bounds.speed:
                    why = 3
            if why > 0:
                break
            stage = advance(params, stage, efforts[k], noise, k, dt)
        return stage, written, why

    return run


def drive(
    kind: Kind,
    params: Any,
    efforts: Array,
    bounds: Bounds,
    dt: float,
    *,
    seed: int = 0,
    state: Any = None,
) -> Driven:
    """Drive a stage without a law, compiled, until the efforts or a bound end it.

    Parameters
    ----------
    kind : Kind
        Kind of stage.
    params : Any
        From ``kind.prepare``.
    efforts : ndarray, shape (n,)
        V at the D/A, one a control period.
    bounds : Bounds
        Where it is ended.
    dt : float
        Control period, s.
    seed : int, optional
        Seed of the sensor's noise.
    state : Any, optional
        The stage's at the start, which is left as it is; None: at rest at 0.

    Returns
    -------
    Driven
        As measured; the period that met a bound is its last and was given 0 V.

    Examples
    --------
    >>> import numpy as np
    >>> from macromicro.machines import piezo
    >>> from macromicro.machines.stage import Bounds, drive
    >>> params, bounds = piezo.KIND.prepare(piezo.DEFAULT), Bounds(-1.0, 1.0, 1.0)  # m, m, m/s
    >>> drive(piezo.KIND, params, np.ones(3), bounds, dt=0.001).t.tolist()  # s
    [0.0, 0.001, 0.002]
    """
    given = np.ascontiguousarray(efforts, dtype=np.float64)
    noise = np.random.default_rng(seed).standard_normal((len(given), kind.noises))
    out = np.empty((2, len(given)))
    start = kind.initial(params) if state is None else arrays.own(state)
    run = compiled(opened(kind))
    state, written, why = run(params, start, bounds, given, noise, out, dt)
    effort = given[:written].copy()
    if why:
        effort[-1] = 0.0
    return Driven(out[0, :written], effort, out[1, :written], state, _ENDED[why])
