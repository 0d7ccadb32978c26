"""The law `terminal`: which part acts when, and what it does on the bench."""

import cmath
import math
from functools import cache

import pytest

from macromicro import api
from macromicro.control import contract
from macromicro.control.stage_law import Sample, Target
from macromicro.control.terminal import estimate, law, model
from macromicro.control.terminal.law import INCH, LAND, REST, TERMINAL, TRACK, WAY
from macromicro.control.terminal.model import Motion, Terminal
from macromicro.design import limits
from macromicro.schema.par import changed
from macromicro.settings import Settings

P = Terminal()
DT = 1e-3


def target(x, v=0.0, a=0.0):
    return Target(x, v, a)


class Carriage:
    """The law's own model, seen by whole counts; an effort acts a delay after it was sent."""

    def __init__(self, p=P, excess=0.0):
        self.p, self.excess = p, excess
        self.m = Motion(0.5 * p.pitch, 0.0, 0.0, 0.0)
        self.memory = law.start(p, Sample(0.0, 0.0))
        self.sent = [0.0, 0.0, 0.0]
        self.t = 0.0

    @property
    def reading(self):
        return math.floor(self.m.x / self.p.pitch) * self.p.pitch

    def period(self, aim):
        sample = Sample(self.t, self.reading)
        self.memory, u = law.step(self.p, self.memory, aim, sample, DT)
        self.sent.append(u)
        late = self.p.delay - DT
        self.m = model.moved(self.p, self.m, self.excess, self.sent[-3], late)
        self.m = model.moved(self.p, self.m, self.excess, self.sent[-2], DT - late)
        self.t += DT
        return u

    def go(self, counts, periods):
        aim = target(counts * self.p.pitch)
        return [(self.period(aim), self.memory.mode) for _ in range(periods)]


@pytest.mark.slow
def test_it_keeps_the_contract_of_laws():
    assert contract.broken(TERMINAL) == []


def test_at_the_target_nothing_is_sent():
    every = Carriage().go(0, 50)
    assert all(pair == (0.0, REST) for pair in every)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_start_is_half_the_effort_beyond_friction_for_half_a_swing(way):
    c = Carriage()
    every = c.go(way * 2000, 60)
    half = round(0.5 / P.frequency / DT)
    share = 1.0 / (1.0 + math.exp(-0.5 * P.decay / P.frequency))
    held = P.coulomb + P.breakaway
    assert every[0] == (pytest.approx(way * (held + (P.full - held) * share)), WAY)
    assert all(abs(u) < P.full for u, _ in every[: half - 1])
    assert all(u == way * P.full for u, _ in every[half + 1 :])


def _left(p, frequency):
    """What the start leaves of a swing of a frequency, by what a single step leaves."""
    steps, had = [], 0.0
    for k in range(round(1.0 / p.frequency / 1e-5) + 2):
        share = 1.0 / law.shaped(p, 1e-5 * k)
        if share != had:
            steps.append((1e-5 * k, share - had))
            had = share
    assert had == 1.0
    w = 2.0j * math.pi * frequency
    return abs(sum(a * cmath.exp((w + p.decay) * t) for t, a in steps))


@pytest.mark.parametrize("off", [0.04, 0.1])
def test_a_start_of_specified_insensitivity_leaves_no_swing_of_a_frequency_that_far_off(off):
    p = P._replace(decay=0.0, insensitivity=off)
    assert _left(p, p.frequency * (1.0 - off)) == pytest.approx(0.0, abs=1e-3)
    assert _left(p, p.frequency * (1.0 + off)) == pytest.approx(0.0, abs=1e-3)
    most = math.tan(0.5 * math.pi * off) ** 2
    between = [_left(p, p.frequency * (1.0 + off * k / 10.0)) for k in range(-10, 11)]
    assert max(between) == pytest.approx(most, abs=1e-3)
    two = _left(p._replace(insensitivity=0.0), p.frequency * (1.0 + off))
    assert two > 5.0 * most


def test_the_swings_decay_is_in_the_three_steps():
    p = P._replace(decay=8.0, insensitivity=1e-4)
    wrong = p._replace(decay=0.0)
    assert _left(p, p.frequency) < 1e-3
    steps = [law.shaped(wrong, t) - law.shaped(p, t) for t in (0.0, 0.6 / p.frequency)]
    assert all(abs(by) > 0.01 for by in steps)


def test_without_a_swing_there_is_nothing_to_shape():
    assert law.shaped(P._replace(frequency=0.0, insensitivity=0.1), 0.0) == 1.0


def test_three_steps_begin_softer_and_end_in_the_count_as_well():
    c = Carriage(P._replace(insensitivity=0.04))
    every = c.go(1400, 600)
    assert every[0][0] < Carriage().go(1400, 1)[0][0]
    half = round(0.5 / P.frequency / DT)
    assert every[half + 2][0] < P.full
    assert every[2 * half + 1][0] == P.full
    assert c.reading == pytest.approx(1400 * P.pitch)


def test_it_lands_within_the_effort_and_comes_to_rest_in_the_count():
    c = Carriage()
    every = c.go(700, 300)
    modes = [mode for _, mode in every]
    order = [m for k, m in enumerate(modes) if k == 0 or m != modes[k - 1]]
    assert order[:3] == [WAY, LAND, REST]
    first = modes.index(LAND)
    assert modes.count(LAND) == round(P.horizon / DT) - 1
    assert all(abs(u) <= P.full for u, _ in every)
    assert min(abs(u) for u, mode in every[first:] if mode == LAND) < P.coulomb
    assert c.reading == pytest.approx(700 * P.pitch)
    assert c.m.v == 0.0


def test_a_landing_ends_with_the_belt_at_rest():
    c = Carriage()
    c.go(700, 300)
    w = 2.0 * math.pi * P.frequency
    left = math.hypot(c.m.q, c.m.s / w) * P.share
    started = (P.full - P.coulomb) * P.push / w**2 * P.share
    assert left < 0.1 * started


def test_more_friction_than_the_model_knows_is_found_and_still_ends_in_the_count():
    c = Carriage(excess=0.4)
    c.go(1400, 600)
    assert c.reading == pytest.approx(1400 * P.pitch)
    assert c.memory.excess == pytest.approx(0.4, abs=0.1)


@pytest.mark.parametrize("counts", [1, 2, 3, -1, -3])
def test_the_last_counts_are_made_good_by_impulses(counts):
    """The goal is moved by less than a landing is planned for: as if one had ended there."""
    c = Carriage()
    c.memory = c.memory._replace(goal=(counts + 0.5) * P.pitch)
    every = c.go(counts, 150)
    inching = [u for u, mode in every if mode == INCH]
    assert inching
    assert all(u * counts > 0.0 for u in inching)
    assert c.reading == pytest.approx(counts * P.pitch)
    assert c.m.v == 0.0


def test_an_impulse_moves_the_model_as_far_as_it_is_sized_for():
    for way in (20e-6, 70e-6, 150e-6, 400e-6):
        periods, level = law._impulse(P, 0.0, way, DT)
        m = Motion(0.0, 0.0, 0.0, 0.0)
        for k in range(80):
            m = model.moved(P._replace(share=0.0), m, 0.0, level if k < periods else 0.0, DT)
        assert periods >= 2.0
        assert level <= P.full
        assert m.x == pytest.approx(way, rel=0.2)


def test_impulses_wait_until_the_carriage_stands():
    c = Carriage()
    c.memory = c.memory._replace(goal=1.5 * P.pitch, gone=0.0)
    every = c.go(1, 60)
    first = next(k for k, (u, _) in enumerate(every) if u != 0.0)
    assert first == round(law.QUIET / DT) - 1


def test_after_a_rest_friction_is_kept_and_the_place_is_that_of_the_count():
    c = Carriage(excess=0.4)
    c.go(1400, 600)
    sample = Sample(9.0, 1400 * P.pitch)
    kept = law.again(P, c.memory, sample)
    assert kept.excess == c.memory.excess
    assert kept.ff == pytest.approx(min(c.memory.ff + P.wander**2, estimate.FIRST**2))
    assert kept._replace(excess=0.0, ff=0.0) == law.start(P, sample)._replace(ff=0.0)


def test_a_trajectory_is_followed_within_a_count():
    c = Carriage()
    worst = 0.0
    for k in range(1500):
        s = 2.0 * math.pi * 1.0
        x = 0.02 * (1.0 - math.cos(s * k * DT))
        v, a = 0.02 * s * math.sin(s * k * DT), 0.02 * s * s * math.cos(s * k * DT)
        c.period(target(x, v, a))
        if k > 300:
            worst = max(worst, abs(c.m.x - 0.5 * P.pitch - x))
    assert c.memory.mode == TRACK
    assert worst < 2.0 * P.pitch


def test_a_trajectory_that_ends_is_landed_at_its_end():
    c = Carriage()
    for k in range(200):
        c.period(target(0.1 * k * DT, 0.1))
    end = round(0.1 * 200 * DT / P.pitch)
    c.go(end, 300)
    assert c.reading == pytest.approx(end * P.pitch)


@pytest.mark.parametrize("delay", [0.0, 0.4e-3, 1e-3, 2e-3])
def test_any_delay_up_to_two_periods_is_looked_ahead(delay):
    """Memory and lookahead together: what was sent and has not acted yet is not lost."""
    p = P._replace(delay=delay, share=0.0)
    b = estimate.standing(p, 0.0, 0.0)
    memory = law.start(p, Sample(0.0, 0.0))._replace(one=5.0, two=4.0, v=0.1)
    b = b._replace(motion=b.motion._replace(v=0.1))
    at = law._ahead(p, memory, b, DT)
    wanted = b.motion
    whole = int(delay / DT + 1e-9)
    if whole == 2:
        pairs = [(4.0, DT), (5.0, DT)]
    elif whole == 1:
        pairs = [(4.0, delay - DT), (5.0, DT)]
    else:
        pairs = [(5.0, delay)]
    for u, h in pairs:
        if h > 1e-12:
            wanted = model.moved(p, wanted, 0.0, u, h)
    assert at.x == pytest.approx(wanted.x, abs=1e-9)
    assert at.v == pytest.approx(wanted.v, abs=1e-9)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A run on the bench, of a share of its friction, each judged move by move."""

    @cache
    def run(share=1.0):
        friction = Settings().bench.friction
        changes = {
            "bench.friction.coulomb": share * friction.coulomb,
            "bench.friction.stribeck": share * friction.stribeck,
        }
        path = tmp_path_factory.mktemp("moves") / "moves.toml"
        path.write_text(
            '[[moves]]\nmacro = ["190 mm", "10 mm", "15 mm", "16 mm"]\nhold = "0.5 s"\n'
        )
        tree = Settings()._replace(controller=Settings().controller.joined("terminal", "law"))
        return api.run(path, settings=changed(tree, {"controller.sequence.wait": 0.5, **changes}))

    return run


def arrivals(run):
    """When each move stays within a count, s; how far it went over; counts left."""
    found = []
    for k in range(4):
        rows = run["move"] == k
        off = run["macro_position"][rows] - run["macro_reference"][rows]
        away = [i for i, e in enumerate(off) if abs(e) > 1.0]
        sign = -math.copysign(1.0, off[0])
        found.append(((away[-1] + 1) * run.dt, max(0.0, float((sign * off).max())), off[-1]))
    return found


@pytest.mark.slow
def test_on_the_bench_moves_end_in_the_count_near_the_limit(bench):
    settings = Settings()
    found = arrivals(bench())
    assert all(left == 0.0 for _, _, left in found)
    assert all(over <= 1.0 for _, over, _ in found[:2])
    for (near, _, _), way in zip(found[:2], (0.19, 0.18), strict=True):
        least = limits.quickest(settings.bench, settings.sensors, way).time
        assert least < near < 1.1 * least


@pytest.mark.parametrize("share", [pytest.param(0.85, marks=pytest.mark.slow), 1.15])
def test_on_a_bench_of_other_friction_no_move_is_missed(bench, share):
    assert all(left == 0.0 for _, _, left in arrivals(bench(share)))


@pytest.mark.slow
def test_on_the_bench_little_swing_is_left(bench):
    """60 um are excited by a step of full effort; 5 um are the limit for moves above 40 mm."""
    run = bench()
    for k in range(2):
        rows = run["move"] == k
        swing = abs(run["true_belt"][rows][600:700]).max()
        assert swing < 5.0


@pytest.mark.parametrize(
    ("way", "short"),
    [(0.4e-3, 0.06e-3), (-1e-3, -0.15e-3), (1.5e-3, 0.1125e-3), (2e-3, 0.0), (5e-3, 0.0)],
)
def test_a_short_way_leaves_a_share_to_impulses(way, short):
    memory = law.start(P, Sample(0.0, 0.0))
    memory, _ = law.step(P, memory, target(way), Sample(0.0, 0.0), DT)
    assert memory.mode in (WAY, LAND) and memory.short == pytest.approx(short, abs=1e-9)


def test_a_way_that_begins_in_motion_is_not_a_short_one():
    c = Carriage()
    c.go(700, 20)
    c.period(target(math.ceil(c.m.x / P.pitch) * P.pitch + 8 * P.pitch))
    assert c.memory.v > 0.0 and c.memory.short == 0.0


@pytest.mark.parametrize("counts", [3, 7, 14, -7, -14])
@pytest.mark.parametrize("excess", [-0.15, 0.15])
def test_a_short_way_under_friction_that_nobody_told_of_ends_in_the_count(counts, excess):
    c = Carriage(excess=excess)
    best = 0.0
    for _ in range(400):
        c.go(counts, 1)
        best = max(best, math.copysign(1.0, counts) * c.reading / P.pitch)
    assert round(c.reading / P.pitch) == counts
    assert best < abs(counts) + 1.5


def test_more_than_a_count_is_made_good_by_two_impulses():
    """The second takes back what the first leaves in the belt; without a belt one is enough."""
    for frequency, share in ((P.frequency, 0.5), (0.0, 1.0)):
        p = P._replace(frequency=frequency)
        b = estimate.standing(p, 0.0, 0.0)
        goal = 0.5 * p.pitch + 3.0 * p.pitch
        periods, level = law._impulse(p, 0.0, share * 3.0 * p.pitch, DT)
        now = law._corrected(p, b, goal, DT)
        assert (now.mode, now.left, now.level) == (INCH, periods, pytest.approx(level))
        periods, level = law._impulse(p, 0.0, p.pitch, DT)
        one = law._corrected(p, b, 1.5 * p.pitch, DT)
        assert (one.left, one.level) == (periods, pytest.approx(level))
