"""Random orders of a host, some of which no host should give, and injuries of the machine."""

from __future__ import annotations

import math
from collections.abc import Callable

from boardsim.avr import PERIOD
from boardtrial.trial import Trial
from macromicro.rig.board import control, protocol
from macromicro.rig.board.protocol import SPEC

_ILLEGAL = (
    (math.nan, 0.0), (math.inf, 0.0), (-math.inf, 1.0), (9.0, 0.0), (-9.0, 0.0), (4.7, 0.0),
    (0.0, -1.0), (0.0, 9.0), (0.0, math.nan), (1e38, 1e38),
)  # fmt: skip


def push(t: Trial) -> None:
    """Constant outputs, the loop on the host."""
    motor = t.random.choice((0.0, t.random.uniform(-4.5, 4.5)))
    ctrl = t.random.choice((0.0, t.random.uniform(0.0, 1.9)))
    for _ in range(t.random.randint(1, 400)):
        t.outputs(motor, ctrl)


def wave(t: Trial) -> None:
    """A sine of the motor's volts."""
    size, rate = t.random.uniform(1.0, 4.5), t.random.uniform(2.0, 60.0)
    for k in range(t.random.randint(50, 400)):
        t.outputs(size * math.sin(2e-3 * math.pi * rate * k), 0.0)


def chatter(t: Trial) -> None:
    """Other outputs in each period."""
    for _ in range(t.random.randint(20, 200)):
        t.outputs(t.random.uniform(-4.5, 4.5), t.random.uniform(0.0, 2.0))


def move(t: Trial) -> None:
    """Set points, the loop on the board."""
    macro, micro = t.random.uniform(50.0, 2750.0), t.random.uniform(0.3e-3, 3.7e-3)
    active = t.random.choice((1, 1, 2, 3))
    for _ in range(t.random.randint(50, 900)):
        t.targets(macro, micro, active)


def hunt(t: Trial) -> None:
    """Set points that change all the time."""
    for _ in range(t.random.randint(2, 8)):
        macro, micro = t.random.uniform(50.0, 2750.0), t.random.uniform(0.3e-3, 3.7e-3)
        for _ in range(t.random.randint(1, 60)):
            t.targets(macro, micro, t.random.choice((0, 1, 2, 3)))


def rest(t: Trial) -> None:
    """Nothing new, but the host is there."""
    for _ in range(t.random.randint(1, 300)):
        t.host.tell("keep", sample=0)


ORDERS = (push, wave, chatter, move, move, hunt, rest)


def silence(t: Trial) -> None:
    """The host says nothing for a while; killed, for all the board can tell."""
    t.line.alone(t.random.choice((100, 400, 600, 900, 1500)))


def cut(t: Trial) -> None:
    """The line is cut while the host goes on."""
    t.line.connected = False
    any_order(t)
    t.line.alone(t.random.randint(0, 900))
    t.line.connected = True


def flips(t: Trial) -> None:
    """Bits of bytes are turned over, both ways."""
    t.line.flips = t.random.choice((1e-3, 1e-3, 1e-2))
    for _ in range(t.random.randint(1, 3)):
        any_order(t)
    t.line.flips = 0.0


def noise(t: Trial) -> None:
    """Bursts of random bytes between frames."""
    for _ in range(t.random.randint(1, 10)):
        t.line.put(t.random.randbytes(t.random.randint(1, 60)))
        t.line.alone(t.random.randint(1, 5))
        t.host.tell("keep", sample=0)


def broken(t: Trial) -> None:
    """Frames that are cut short, too long, of no kind, of another size."""
    frame = protocol.encode("outputs", 1, sample=0, motor=4.0, ctrl=1.0)
    framed = protocol.framing.frame
    for _ in range(t.random.randint(1, 10)):
        t.line.put(
            t.random.choice((
                frame[: t.random.randint(1, len(frame) - 1)] + b"\0",
                framed(bytes((5, 1)) + bytes(t.random.randint(9, 60))),
                framed(bytes((t.random.choice((0, 12, 67, 200, 255)), 1, 2, 3))),
                framed(bytes((4, 1, 7))),
            ))
        )  # fmt: skip
        t.line.alone(1)


def reset(t: Trial) -> None:
    """The reset pin, in motion."""
    t.line.bench.avr.reset()
    t.judge.reset()
    any_order(t)


def encoder(t: Trial) -> None:
    """A channel of the encoder breaks, or both touch."""
    t.hurt.add("encoder")
    kind = t.random.choice(("encoder_a", "encoder_b", "short"))
    t.line.bench.shorted = kind == "short"
    t.line.bench.cut = "" if kind == "short" else kind
    any_order(t)
    any_order(t)


def edges(t: Trial) -> None:
    """Bursts of edges that no carriage made."""
    t.hurt.add("encoder")
    bench = t.line.bench
    for _ in range(t.random.randint(1, 20)):
        when = bench.tick * PERIOD + 100
        for _ in range(t.random.randint(1, 40)):
            when += t.random.randint(20, 300)
            if when > (bench.tick + 1) * PERIOD - 500:
                break
            name = t.random.choice(("encoder_a", "encoder_b"))
            bench.avr.pin(name, t.random.randint(0, 1), when)
        t.host.tell("keep", sample=0)


def hall(t: Trial) -> None:
    """The Hall sensor's wire breaks, touches the supply, or its value stands."""
    t.hurt.add("hall")
    t.line.bench.hall = t.random.choice((0.0, 5.0, t.random.uniform(0.5, 4.5)))
    any_order(t)
    any_order(t)


def line_of(name: str, level: int) -> Callable[[Trial], None]:
    """An input that shows what is not so."""

    def injury(t: Trial) -> None:
        t.hurt.add(name)
        t.line.bench.forced[name] = level
        any_order(t)
        any_order(t)

    injury.__name__ = name
    injury.__doc__ = f"The line {name} is {level} whatever is so."
    return injury


def illegal(t: Trial) -> None:
    """Efforts that are no numbers or beyond the limits."""
    motor, ctrl = t.random.choice(_ILLEGAL)
    t.outputs(motor, ctrl)


def nowhere(t: Trial) -> None:
    """Set points that are no numbers, or far away."""
    t.hurt.add("targets")
    macro = t.random.choice((math.nan, math.inf, -1e9, 1e30, 100.0))
    micro = t.random.choice((math.nan, math.inf, -1.0, 1e-3))
    for _ in range(t.random.randint(1, 300)):
        t.targets(macro, micro, t.random.choice((1, 2, 3)))


def impostor(t: Trial) -> None:
    """Requests that must be refused: another parameter in motion, drive with wrong ones."""
    if t.host.sample.get("state", 0) >> SPEC["state"]["driving"] & 1:
        told = t.host.ask("set", "parameter", index=0, value=9.0)
        if told is not None and not t.judge.still_on():
            t.judge.configured = False  # it had stopped by then, and took it
            return
    t.host.tell("begin", parameters=t.random.randrange(65536))


def spoiled(t: Trial) -> None:
    """A parameter is changed behind the host's back, and another host drives."""
    t.host.tell("stop")
    index = t.random.randrange(parameters_of(t))
    t.judge.configured = False
    t.host.ask("set", "parameter", index=index, value=t.random.uniform(-5.0, 5.0))
    t.host.tell("begin", parameters=t.judge.crc)
    any_order(t)


def parameters_of(t: Trial) -> int:
    """How many parameters the board has."""
    return len(control.flat(t.judge.params))


def halt(t: Trial) -> None:
    """Stop, and orders behind it."""
    t.host.tell("stop")
    any_order(t)


def deaf(t: Trial) -> None:
    """No samples for a while."""
    t.host.ask("stream", "done", on=0)
    any_order(t)
    t.host.ask("stream", "done", on=1)


def any_order(t: Trial) -> None:
    """One of the orders."""
    t.random.choice(ORDERS)(t)


INJURIES = (
    silence, cut, flips, noise, broken, reset, encoder, edges, hall, illegal, nowhere, impostor,
    spoiled, halt, deaf, line_of("limit_low", 1), line_of("limit_high", 1),
    line_of("bridge_fault", 0), line_of("extend", 1), line_of("contract", 1),
)  # fmt: skip
