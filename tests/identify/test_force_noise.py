"""What disturbs a mass, from periodograms (`macromicro.identify._force_noise`)."""

from __future__ import annotations

import numpy as np
import pytest

from macromicro.identify._force_noise import Level, Shown, _likelihood, binned, drawn, levels

DT, N = 1e-3, 8000
NOTHING = np.zeros((N, 0))


def seen(level: Level, seed: int) -> Shown:
    """A record of a force, seen as it is, and of a sensor whose noise is differentiated once."""
    random = np.random.default_rng(seed)
    noise = np.sqrt(level.sensor) * random.standard_normal(N + 1)
    w = drawn(level, N, DT, random) + np.diff(noise)
    turn = 2.0 * np.pi * np.arange(N // 2 + 1) / N
    return binned(w, DT, np.ones(len(turn)), 4.0 * np.sin(0.5 * turn) ** 2, NOTHING)


def middle(found: list[Level], name: str) -> float:
    return float(np.median([getattr(level, name) for level in found]))


def test_a_drawn_force_has_the_spectrum_that_is_told() -> None:
    level = Level(white=2e-3, slow=0.5, corner=8.0, sensor=0.0)
    w = drawn(level, 4_000_000, DT, np.random.default_rng(3))
    keep = np.exp(-2.0 * np.pi * level.corner * DT)
    # White: a / dt; slow: an autoregression of the first order whose spectrum at rest is b.
    power = level.white / DT + level.slow / DT * (1.0 - keep) / (1.0 + keep)
    assert np.var(w) == pytest.approx(power, rel=0.05)
    means = w.reshape(-1, 4000).mean(axis=1)
    assert np.var(means) * 4.0 == pytest.approx(level.white + level.slow, rel=0.15)


def test_a_slow_force_starts_as_it_goes_on() -> None:
    level = Level(white=0.0, slow=1.0, corner=0.5, sensor=0.0)
    first = [drawn(level, 2, DT, np.random.default_rng(k))[0] for k in range(4000)]
    assert np.var(first) == pytest.approx(np.pi * level.corner, rel=0.1)


def test_white_force_and_sensor_are_told_apart() -> None:
    level = Level(white=4e-6, slow=0.0, corner=1.0, sensor=1e-3)
    found = levels([seen(level, k) for k in range(2)], 60, N * DT, DT)
    assert middle(found, "white") == pytest.approx(4e-6, rel=0.5)
    assert middle(found, "sensor") == pytest.approx(1e-3, rel=0.05)


def test_a_slow_force_is_left_as_open_as_it_is() -> None:
    level = Level(white=1e-5, slow=0.4, corner=0.3, sensor=1e-3)
    inside = 0.0
    for k in range(4):
        slow = [one.slow for one in levels([seen(level, k)], 60, N * DT, DT)]
        inside += np.quantile(slow, 0.025) <= 0.4 <= np.quantile(slow, 0.975)
        assert max(slow) > 1.5 * min(slow)
    assert inside >= 3


def test_a_sensor_alone_needs_no_force() -> None:
    level = Level(white=0.0, slow=0.0, corner=1.0, sensor=2e-3)
    found = levels([seen(level, 5)], 10, N * DT, DT)
    assert all(one.white == one.slow == 0.0 for one in found)
    assert found[0].sensor == pytest.approx(2e-3, rel=0.1)


def test_the_ends_of_noise_that_is_differentiated_twice_look_like_no_force() -> None:
    """Of a mass on a spring the force is a second difference: a million times its low end."""
    noise = 1e-3 * np.random.default_rng(1).standard_normal(N + 2)
    turn = 2.0 * np.pi * np.arange(N // 2 + 1) / N
    answer = 1e-8 + (2.0 * np.sin(0.5 * turn)) ** 4
    shown = binned(np.diff(noise, 2), DT, np.ones(len(turn)), answer, NOTHING)
    found = levels([shown], 10, N * DT, DT)
    assert all(one.white == one.slow == 0.0 for one in found)
    assert found[0].sensor == pytest.approx(1e-6, rel=0.05)


def test_the_same_records_give_the_same_levels() -> None:
    level = Level(white=1e-5, slow=0.1, corner=0.3, sensor=1e-3)
    assert levels([seen(level, 1)], 9, 8.0, DT) == levels([seen(level, 1)], 9, 8.0, DT)


@pytest.mark.slow
@pytest.mark.parametrize("known", [True, False])
def test_a_slow_force_that_parameters_took_part_of_is_found_whole(known: bool) -> None:
    """Slow swings are fitted, and take most of a slow force. As much is taken of those drawn, by
    what is left of it; where that parameters took part is not known, far less."""
    level = Level(white=1e-4, slow=0.4, corner=0.5, sensor=1e-9)
    n, dt = 2000, 4.0 * DT
    t = np.linspace(0.0, 2.0 * np.pi, n)
    taken = np.column_stack([f(k * t) for k in (1, 2, 3, 4) for f in (np.cos, np.sin)])
    back = np.linalg.pinv(taken)
    flat = np.ones(n // 2 + 1)
    ranks = []
    for k in range(6 if known else 5):
        force = drawn(level, n, dt, np.random.default_rng(k))
        lost = taken @ (back @ force)
        shown = binned(force - lost, dt, flat, flat, taken if known else taken[:, :0])
        random = np.random.default_rng(0)
        again = [drawn(one, n, dt, random) for one in levels([shown], 40, n * dt, dt)]
        told = np.mean((taken @ (back @ np.transpose(again))) ** 2, axis=0)
        ranks.append(np.mean(told < np.mean(lost**2)))
    assert np.mean(ranks) < 0.65 if known else np.mean(ranks) > 0.8
    assert not known or np.mean(ranks) > 0.35


def test_columns_that_take_nothing_or_the_same_change_nothing() -> None:
    random = np.random.default_rng(4)
    w, column = random.standard_normal(N), random.standard_normal(N)
    flat = np.ones(N // 2 + 1)
    one = binned(w, DT, flat, flat**2 * 0.5, column[:, None])
    more = binned(w, DT, flat, flat**2 * 0.5, np.outer(column, [1.0, 0.0, -7.0]))
    at = np.log([1e-4, 1e-3, 2.0, 1e-3])
    assert _likelihood(more)(at) == pytest.approx(_likelihood(one)(at), rel=1e-6)
    assert _likelihood(one)(at) > _likelihood(binned(w, DT, flat, flat**2 * 0.5, NOTHING))(at)


def test_columns_that_are_alike_under_a_spectrum_are_no_error() -> None:
    """They differ at high frequencies alone, where a level may be that counts for nothing."""
    t = np.arange(N) * DT
    slow, quick = np.sin(5.0 * t), 1e-2 * np.sin(2.0 * np.pi * 400.0 * t)
    taken = np.column_stack([slow, slow + quick])
    turn = 2.0 * np.pi * np.arange(N // 2 + 1) / N
    answer = 1e-14 + (2.0 * np.sin(0.5 * turn)) ** 8
    likely = _likelihood(binned(quick, DT, np.ones(len(turn)), answer, taken))
    for level in (1e-12, 1e-3, 1e9):
        assert np.isfinite(likely(np.log([1e-30, 1e-30, 1.0, level])))


def test_levels_beyond_all_numbers_are_not_likely() -> None:
    """Where a search goes that knows no bounds: no error, and nothing to stay for."""
    random = np.random.default_rng(4)
    flat = np.ones(N // 2 + 1)
    likely = _likelihood(binned(random.standard_normal(N), DT, flat, flat, NOTHING))
    for beyond in (np.full(4, 800.0), np.array([0.0, 0.0, -800.0, 800.0])):
        assert likely(beyond) == -np.inf
    assert np.isfinite(likely(np.zeros(4)))


def test_bins_hold_the_power_of_all_frequencies() -> None:
    w = np.random.default_rng(0).standard_normal(1000)
    ones = np.ones(501)
    every = binned(w, DT, ones, ones, np.outer(w, [2.0]))
    assert every.values.sum() == pytest.approx(499 * 2.0 / 3.0)
    assert every.f.min() == 1.0 and every.f.max() < 500.0
    assert every.values @ every.power / every.values.sum() == pytest.approx(DT, rel=0.1)
    assert every.sensor == pytest.approx(np.full(len(every.f), DT))
    assert every.fitted[:, 0, 0] == pytest.approx(4.0 * every.power)
    assert every.fitted[:, 0, 1] == pytest.approx(2.0 * every.power)
