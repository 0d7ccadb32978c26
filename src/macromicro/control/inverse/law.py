"""Position control by heat content, with the inverse of an identified model of the actuator."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from macromicro.columns import Meaning, Quantity
from macromicro.control.converter import rounded
from macromicro.control.inverse import learned
from macromicro.control.inverse.learned import Learned
from macromicro.control.inverse.model import Inverse, Prepared, prepare
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.hysteresis.invert import invert
from macromicro.kernel import kernel
from macromicro.models import stressed
from macromicro.models.stressed import Stressed, StressedState

JUMP = 1e-3  # mm: a target that changes by more begins a step
AWAY = 0.02  # mm: further from the target the filter stays quick
EDGE = 1e-7  # mm: this side of a place the relays' dead zone ends
BACK = 20e-3  # mm: a trajectory that is further back is followed back at once
MOST_OWED = 20.0  # K of heat that rounding may owe


class State(NamedTuple):
    model: Annotated[StressedState, Meaning("the actuator at the last sample, by the model")]
    shown: Annotated[float, Meaning("its place as the sensor would show it", "mm")]
    offset: Annotated[float, Meaning("what the sensor shows beyond that", "mm")]
    drift: Annotated[float, Meaning("rate of the offset", "mm/s")]
    goal: Annotated[float, Meaning("last target", "mm")]
    since: Annotated[float, Meaning("since it jumped", "s")]
    sent: Annotated[float, Meaning("CTRL that acts in this period", "V")]
    owed: Annotated[float, Meaning("heat that the D/A's rounding owes", "K")]
    learned: Learned


class Told(NamedTuple):
    place: Annotated[float, Quantity("mm", "place by the law's model", column="place")]
    offset: Annotated[float, Quantity("mm", "sensor beyond the model", column="offset")]
    wire: Annotated[float, Quantity("K", "wires above ambient by the law's model", column="wire")]
    plates: Annotated[
        float, Quantity("K", "plates above ambient by the law's model", column="plates")
    ]
    base: Annotated[float, Quantity("K", "learned warming of the wires", column="base")]
    more: Annotated[float, Quantity("1", "learned excess heat", column="heat")]
    loss: Annotated[float, Quantity("1", "learned excess loss", column="loss")]
    late: Annotated[float, Quantity("ms", "learned excess lag", column="late", scale=1e3)]


def start(p: Prepared, sample: Sample) -> State:
    m = stressed.cold(p.model)
    return State(m, m.x, 0.0, 0.0, m.x, 0.0, 0.0, 0.0, learned.nothing(p.doubts))


@kernel
def _sensed(p: Prepared, s: State, x: float, dt: float) -> float:
    """The model's place after the sensor's first-order lag."""
    lag = p.sensor + 0.5 * s.learned.values[learned.LAG]
    if lag <= 1e-6:
        return x
    mean = 0.5 * (s.model.x + x)
    return mean + (s.shown - mean) * math.exp(-dt / lag)


@kernel
def rest(p: Prepared, s: State, sample: Sample, dt: float) -> State:
    """A period without effort: the model cools, the offset stays."""
    m = learned.corrected(p.model, s.learned)
    ahead = stressed.step(m, s.model, s.sent, dt)
    shown = _sensed(p, s, ahead.x, dt)
    known, _ = learned.learn(m, s.model, ahead, s.learned, p.doubts, p.forget, math.nan, 0.0, dt)
    return State(ahead, shown, s.offset, 0.0, math.nan, 0.0, 0.0, 0.0, known)


@kernel
def _heated(s: StressedState, wrong: float) -> StressedState:
    return StressedState(s.heat, s.cut, s.wire, s.plates, s.body, s.content + wrong, s.memory, s.x)


@kernel
def wanted(p: Stressed, s: StressedState, place: float) -> float:
    """Heat content of the wires that belongs to a place (mm) on the way there."""
    h = p.hysteresis
    share = min(max((place - h.low) / h.span, 0.0), 1.0)
    return stressed.content_at(p, s.memory, invert(h.table, s.memory, share))


@kernel
def _onward(
    m: Stressed, s: StressedState, aim: float, speed: float, turn: float, content: float,
    loss: float, top: float,
) -> float:  # fmt: skip
    """Place to aim at on a trajectory; it crosses a reversal's dead zone only at the turn."""
    side = math.copysign(1.0, speed)
    edge = wanted(m, s, s.x - side * EDGE) - content
    power = (loss if side > 0.0 else top - loss) / m.ladder.c1
    if -side * edge > 0.0 and turn < 0.5 * abs(edge) / max(power, 1e-9):
        side = -side
    if side * (s.x - aim) > 0.0 and side * (s.x - aim) < BACK:
        return s.x + side * EDGE
    return aim


@kernel
def step(
    p: Prepared, s: State, target: Target, sample: Sample, dt: float
) -> tuple[
    Annotated[State, Meaning(name="state")], Annotated[float, Meaning("CTRL", "V", name="effort")]
]:
    m = learned.corrected(p.model, s.learned)
    n = m.ladder
    goal, speed = 1e3 * target.position, 1e3 * target.velocity
    since, offset, drift = s.since + dt, s.offset, s.drift
    if not math.isnan(sample.position):
        place = 1e3 * sample.position
        if abs(goal - place) > AWAY or not abs(goal - s.goal) <= JUMP:
            since = 0.0
        time = max(p.quick if since < p.settle else p.calm, 2.0 * dt)
        beyond = place - s.shown - offset
        drift += dt * (beyond / (time * time))
        offset += dt * (drift + 2.0 * beyond / time)
    # What was sent before acts until this period's effort does.
    ahead = stressed.step(m, s.model, s.sent, dt)
    shown = _sensed(p, s, ahead.x, dt)
    beyond, gone = 1e3 * sample.position - s.shown, ahead.x - s.model.x + drift * dt
    known, wrong = learned.learn(m, s.model, ahead, s.learned, p.doubts, p.forget, beyond, gone, dt)
    ahead = _heated(ahead, wrong)
    loss = (ahead.wire - ahead.plates) / n.r1
    content = ahead.content + m.lag * (ahead.heat - loss) / n.c1
    top = m.heat[len(m.heat) - 1]
    then = 2.0 * dt + m.lag
    aim = goal + speed * then - offset - drift * then
    if speed != 0.0:
        aim = _onward(m, ahead, aim, speed, target.turn - then, content, loss, top)
    rate = (wanted(m, ahead, aim) - content) / max(p.reach, dt)
    if speed == 0.0:  # slowly where little is missing, or reversals would swing to and fro
        most = p.floor + p.rise * abs(goal - offset - ahead.x)
        rate = min(max(rate, -most), most)
    heat = min(max(loss + n.c1 * rate, 0.0), top)
    if goal <= m.hysteresis.low + JUMP:  # fully extended needs no heat
        heat = 0.0
    volts = rounded(stressed.level(m, min(max(heat + s.owed, 0.0), top)), p.step)
    owed = s.owed + heat - stressed.static_heat(m, volts)
    owed = min(max(owed, -MOST_OWED), MOST_OWED)
    return State(ahead, shown, offset, drift, goal, since, volts, owed, known), volts


@kernel
def tell(s: State) -> Told:
    """What is recorded, with places in mm."""
    return Told(
        s.model.x,
        s.offset,
        s.model.wire,
        s.model.plates,
        s.learned.values[learned.BASE],
        s.learned.values[learned.HEAT],
        s.learned.values[learned.LOSS],
        s.learned.values[learned.LAG],
    )


INVERSE = StageLaw(
    "inverse",
    Inverse,
    Told,
    start,
    step,
    tell=tell,
    prepare=prepare,
    params=Prepared,
    rest=rest,
    model_of="micro",
)
