"""Laws of other packages: found by name, settings and memories with them, compiled or not."""

from __future__ import annotations

import math
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from macromicro import kernel
from macromicro.control import macro, outside, settings, supervisor
from macromicro.control.outside import Held
from macromicro.control.settings import Control
from macromicro.control.stage_law import Sample, StageLaw, Target
from macromicro.errors import InputError
from macromicro.models.macro import MacroModel, closed_loop, rollout
from macromicro.models.macro import MacroModelState as State
from macromicro.nominal import PITCH
from macromicro.schema.config import as_toml, changed_toml, difference, load_overrides, overridden
from macromicro.schema.par import entries
from macromicro.settings import Settings, choose
from tests.control.own_laws import HERE, Gains, InCounts, Memory, PlainGains, begin, slide

SLIDING, PLAIN, COUNTS = (f"{HERE}:{name}" for name in ("sliding", "plain", "InCounts"))
AIM = Target(300.0, 20.0, 3.0)


def law(name: str, **gains: float) -> macro.MacroLaw:
    control = Control().joined(name, "a test")
    return settings.prepare(control._replace(own=control.own._replace(**gains))).macro


@pytest.mark.parametrize("name", [SLIDING, PLAIN])
def test_it_sees_metres(name: str) -> None:
    """Target, speed and reading by the pitch; time and period as they are; (4.10)'s inverse on."""
    p = law(name, slope=3.0)
    memory, effort = macro.step(p, macro.begun(p), AIM, Sample(0.7, 120.0), 1e-3)
    assert p.compiles is (name == SLIDING)
    seen = Sample(0.7, 120.0 * PITCH)
    aim = Target(300.0 * PITCH, 20.0 * PITCH, 3.0 * PITCH)
    gains = PlainGains(slope=3.0)
    mine, asked = slide(gains, begin(gains, seen), aim, seen, 1e-3)
    assert effort == asked + 3.0 and 0.0 < asked < 2.0
    assert memory == (*macro.rest(0.0), Held(0.0, mine))


def test_it_sees_counts_where_it_says_so() -> None:
    """A class is a law too; uncompensated as it says; its `integral` is recorded."""
    p = law(COUNTS)
    assert (p.scale, p.dead_zone, p.limit) == (1.0, 0.0, 5.0)
    first, effort = macro.step(p, macro.begun(p), AIM, Sample(0.0, 250.0), 0.5)
    assert effort == 0.02 * 50.0
    assert macro.integral(first) == 250.5  # begun by `start`, from the first reading
    second, _ = macro.step(p, first, AIM, Sample(0.0, 7.0), 0.5)
    assert macro.integral(second) == 251.0  # and not again
    anew, _ = macro.step(p, macro.again(second), AIM, Sample(0.0, 7.0), 0.5)
    assert macro.integral(anew) == 7.5
    assert macro.integral(macro.begun(law(SLIDING))) == 0.0


def test_it_begins_with_memories_of_this_package_alone() -> None:
    """As the live machine leaves them where a stage rests."""
    p = law(COUNTS)
    at_once, effort = macro.step(p, macro.rest(0.0), AIM, Sample(0.0, 250.0), 0.5)
    assert (at_once, effort) == macro.step(p, macro.begun(p), AIM, Sample(0.0, 250.0), 0.5)


def test_efforts_are_limited() -> None:
    p = law(COUNTS)._replace(limit=0.25)
    for x, most in ((0.0, 0.25), (900.0, -0.25)):
        assert macro.step(p, macro.begun(p), AIM, Sample(0.0, x), 1e-3)[1] == most


def test_laws_of_this_package_leave_its_memory() -> None:
    p = law(SLIDING)
    left = (*macro.rest(0.0), Held(0.0, Memory(1.0, 2.0)))
    for k in range(macro.SHIPPED):
        memory, _ = macro.step(p._replace(law=k), left, AIM, Sample(0.0, 120.0), 1e-3)
        assert memory[macro.SHIPPED :] == left[macro.SHIPPED :] and memory[k] != left[k]


def test_compiled_and_interpreted_and_plain_python_agree() -> None:
    """Bit for bit, on the thesis' model: the kernel compiled and not, and the plain law."""
    model, aim = MacroModel(), np.repeat([900.0, 200.0], 400)
    x, motor = closed_loop(model, law(SLIDING), aim, counted=True)
    plain = closed_loop(model, law(PLAIN), aim, counted=True)
    out = np.empty((2, len(aim)))
    rollout(model, law(SLIDING), State(0.0, 0.0), aim, True, out)
    assert np.array_equal(out, (x, motor)) and np.array_equal(plain, (x, motor))
    assert 800.0 < x[399] < 1000.0 and x[-1] < 300.0


def test_a_compiled_supervisor_keeps_its_memory() -> None:
    """Its type does not change at a new move, of whatever law."""
    step = kernel.compiled(macro.again)
    memory = (*macro.rest(3.0), Held(0.0, Memory(1.0, 2.0)))
    assert step(memory) == macro.again(memory) == (*macro.rest(0.0), Held(2.0, Memory(1.0, 2.0)))
    unborn = (*macro.rest(3.0), Held(1.0, Memory(1.0, 2.0)))
    assert step(unborn) == macro.again(unborn) == (*macro.rest(0.0), unborn[-1])
    p = law(SLIDING)
    assert kernel.compiled(macro.begun)(p) == macro.begun(p)
    control = settings.prepare(Control().joined(SLIDING, "a test"))
    assert supervisor.begin(0.0, control).macro == macro.begun(control.macro)
    assert kernel.compiled(macro.integral)(memory) == 0.0


@given(st.floats(1.0, 900.0), st.floats(0.1, 5.0))
def test_settings_have_its_gains(slope: float, reach: float) -> None:
    """In a file, in what differs from the defaults, in what is written and read back."""
    table = {"controller.macro_law": SLIDING, "controller.own.slope": f"{slope!r} 1/s"}
    tree = overridden(Settings(), {**table, "controller.own.reach": f"{reach!r} V"}, "a file")
    assert tree.controller.own == Gains(slope, reach)
    differs = difference(tree, Settings())
    assert set(differs) == {
        "controller.macro_law", "controller.own.slope", "controller.own.reach",
    }  # fmt: skip
    assert SLIDING in repr(tree) and pickle.loads(pickle.dumps(tree)) == tree


def test_files_of_settings_name_it(tmp_path: pytest.TempPathFactory) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f'[controller]\nmacro_law = "{SLIDING}"\n[controller.own]\nslope = "7 1/s"\n')
    tree = load_overrides(path, Settings())
    assert tree["controller.own.slope"] == 7.0
    for text in (as_toml(tree), changed_toml(tree, Settings())):
        path.write_text(text)
        assert load_overrides(path, Settings()) == tree
    assert choose(Settings(), path, "pid").controller.macro_law == "pid"
    assert choose(Settings(), path, SLIDING) == tree
    path.write_text('[controller.own]\nslope = "7 1/s"\n')
    assert choose(Settings(), path, SLIDING) == tree
    with pytest.raises(InputError, match=r"controller.own.*unknown key"):
        choose(Settings(), path, None)


def test_a_client_cannot_name_another() -> None:
    """What is imported is decided by settings and options: a word accepts what is there."""
    known = {e.path: e for e in entries(Control().joined(SLIDING, "a test"))}
    assert known["macro_law"].check(SLIDING, "x") == SLIDING
    assert known["macro_law"].check("pid", "x") == "pid"
    with pytest.raises(InputError):
        known["macro_law"].check(PLAIN, "x")
    with pytest.raises(InputError):
        {e.path: e for e in entries(Control())}["macro_law"].check(SLIDING, "x")


@pytest.mark.parametrize(
    ("name", "said"),
    [
        (
            "sliding",
            "one of pid, pd-initial, pd-tuned, p, pi, pi-antiwindup, terminal, inverse, pid-heat; "
            "or MODULE:LAW",
        ),
        ("", "MODULE:LAW"),
        (f"{HERE}:slidng", "such as sliding"),
        (f"{HERE}:number", "int, lacks gains, memory, start, step"),
        (f"{HERE}:bare", "gains of .*NamedTuple of floats with defaults"),
        ("tests.control.absent:x", "no module tests.control.absent"),
        (f"{HERE}:twin", "has the gains of .*:sliding, Gains.*a type of gains of its own"),
    ],
)
def test_what_is_no_law_is_said(name: str, said: str) -> None:
    Control().joined(SLIDING, "a test")
    with pytest.raises(InputError, match=rf"(?s)--law.*{said}"):
        Control().joined(name, "--law")


@pytest.mark.parametrize(
    ("part", "value", "said"),
    [
        ("unit", "mm", "'m' or 'count'"),
        ("step", 3, "a function"),
        ("memory", tuple, "a NamedTuple of floats"),
        ("gains", Memory, "with defaults"),
    ],
)
def test_a_part_of_the_wrong_kind(part: str, value: object, said: str) -> None:
    good = StageLaw("x", Gains, Memory, begin, slide)
    assert outside.check(good, "x", "--law") == good
    with pytest.raises(InputError, match=f"{part} of x.*{said}"):
        outside.check(good._replace(**{part: value}), "x", "--law")


def test_an_entry_point_is_a_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an installed package, group macromicro.laws."""
    monkeypatch.setattr(outside.plugins, "entry_points", lambda group: {"slide": COUNTS})
    assert outside.is_name("slide") and not outside.is_name("slid")
    assert outside.import_law("slide", "--law") is InCounts
    with pytest.raises(InputError, match="such as slide"):
        Control().joined("slid", "--law")


def test_its_sources_decide_where_it_is_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """The package's own kernels stay in their folder; an edit of the law makes another."""
    Control().joined(SLIDING, "a test")
    ours = kernel.cache_folder(joined=False)
    assert kernel.cache_folder() != ours
    monkeypatch.setattr(kernel, "_joined", {})
    assert kernel.cache_folder() == ours
    kernel.admit("x", "1")
    one = kernel.cache_folder()
    kernel.admit("x", "2")
    assert kernel.cache_folder() != one != ours


def _noted(out: np.ndarray, k: int, kept: Any, first: int) -> None:
    outside.note(out, k, kept, first)


def test_what_a_law_has_recorded() -> None:
    """Fields of its memory that are annotated with a `Quantity`, compiled and interpreted."""
    for name in (SLIDING, COUNTS):
        Control().joined(name, "a test")
    (column,) = outside.columns((Gains(),))
    assert column[:3] == ("law_speed", "mm/s", "filtered speed")
    assert outside.columns(()) == outside.columns((InCounts.gains(),)) == ()
    kept = (Held(0.0, Memory(3.0, 0.25)),)
    for way in (_noted, kernel.compiled(_noted)):
        out = np.zeros((4, 3))
        way(out, 1, kept, 2)
        assert out[2, 1] == 250.0 and np.count_nonzero(out) == 1
        way(out, 0, (), 2)
        assert np.count_nonzero(out) == 1


def test_gains_not_a_number_are_not_taken() -> None:
    with pytest.raises(InputError, match=r"own.slope"):
        overridden(
            Settings(), {"controller.macro_law": SLIDING, "controller.own.slope": math.nan}, "x"
        )


@pytest.mark.parametrize("rested", [True, False])
def test_after_a_rest_a_law_goes_on_from_what_it_learned(rested: bool) -> None:
    """`terminal` keeps the friction that it found; it stands again."""
    p = law("terminal")
    first = macro.step(p, macro.begun(p), AIM, Sample(0.0, 120.0), 1e-3)[0]
    learned = first[-1].memory._replace(excess=0.3, v=0.1)
    kept = (*first[:-1], Held(outside.RESTED if rested else 0.0, learned))
    found = macro.step(p, kept, AIM, Sample(1.0, 120.0), 1e-3)
    assert kernel.compiled(macro.step)(p, kept, AIM, Sample(1.0, 120.0), 1e-3) == found
    assert found[0][-1].memory.excess == pytest.approx(0.3, abs=0.05)
    assert (abs(found[0][-1].memory.v) < 1e-3) == rested


def test_after_a_rest_a_law_without_again_begins_anew() -> None:
    p = law(SLIDING)
    kept = (*macro.rest(0.0), Held(2.0, Memory(1.0, 2.0)))
    found = macro.step(p, kept, AIM, Sample(1.0, 120.0), 1e-3)
    assert found == macro.step(p, macro.begun(p), AIM, Sample(1.0, 120.0), 1e-3)
    assert kernel.compiled(macro.step)(p, kept, AIM, Sample(1.0, 120.0), 1e-3) == found
