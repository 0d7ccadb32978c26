"""A whole commissioning: steps, resuming, verification, page and machine file."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from tests.commission.axes import PLAIN, Virtual, session

from macromicro.commission import _store, axis, procedure, report, running
from macromicro.commission._probing import Creep
from macromicro.commission.procedure import Options, Work, sign
from macromicro.commission.running import Commissioned, Place, commission
from macromicro.commission.stand import Stand
from macromicro.errors import InputError, ProblemError
from macromicro.machines import machine
from macromicro.place import ANGLE

OPTIONS = Options(effort=8.0, speed=1.0, creep=0.04, travel=0.3)
STARTED = "2026-01-01 12:00:00"


def place(made: list[Virtual] | None = None, **how: Any) -> Place:
    def make(seed: int) -> Virtual:
        rig = Virtual(PLAIN, late=1, ripple=0.02, **how)
        if made is not None:
            made.append(rig)
        return rig

    return Place("an axis <b>", make, 1e-3, 1e-5, 8.0, False)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Commissioned, Path, list[str]]:
    out = tmp_path_factory.mktemp("commission")
    said: list[str] = []
    found = commission(
        place(sign=-1.0),
        OPTIONS,
        out,
        ask=lambda title, intent: said.append(f"{title}: {intent}"),
        done=lambda title: said.append(f"{title} done"),
    )
    report.write(out, found, place(sign=-1.0), STARTED)
    return found, out, said


class Again(NamedTuple):
    """Another commissioning after the steps of `done`, what it found, and what it asked."""

    there: Place
    out: Path
    asked: list[str]

    def found(self, **how: Any) -> Commissioned:
        return commission(
            self.there,
            OPTIONS,
            self.out,
            ask=lambda title, intent: self.asked.append(f"{title}: {intent}"),
            **how,
        )

    def page(self, found: Commissioned) -> str:
        report.write(self.out, found, self.there, STARTED)
        return (self.out / report.PAGE).read_text()

    def titles(self) -> list[str]:
        return [one.split(":")[0] for one in self.asked]


@pytest.fixture
def again(done: tuple[Commissioned, Path, list[str]], tmp_path: Path) -> Callable[..., Again]:
    """After the steps of `done`; the same records need not be fitted and drawn again."""
    out = tmp_path / "out"
    shutil.copytree(done[1], out)
    known = axis.KIND._replace(model=lambda work: done[0].model, figures={})

    def made(rigs: list[Virtual] | None = None, **parts: Any) -> Again:
        return Again(place(rigs, sign=-1.0)._replace(kind=known._replace(**parts)), out, [])

    return made


@pytest.mark.parametrize(
    ("other", "words"),
    [({"dt": 0.15}, ["dt", "150 ms", "100 ms"]), ({"pitch": 0.0}, ["--pitch", "above zero"])],
)
def test_what_the_machine_s_file_would_refuse_is_refused_before_any_motion(
    other: dict[str, float], words: list[str]
) -> None:
    made: list[Virtual] = []
    with pytest.raises(InputError) as refused:
        commission(place(made)._replace(**other), OPTIONS)
    assert not made
    for word in words:
        assert word in str(refused.value)


def test_every_step_says_what_it_will_do_before_it_does_it(
    done: tuple[Commissioned, Path, list[str]],
) -> None:
    said = done[2]
    assert [s.endswith(" done") for s in said] == [False, True] * 6 + [True] + [False, True] * 2
    assert said[12] == "gains by search on the model done"
    assert "20 s" in said[0] and "at most 8 V" in said[0]
    assert "0 to at most 8 V" in said[2]
    assert "40 mm/s" in said[4] and "300 mm" in said[4]
    assert "7 positions" in said[6]
    assert "40 strokes" in said[8] and "1 m/s" in said[8]
    assert "16 passes" in said[10] and "to 450 Hz" in said[10]
    assert "makes 8 moves within its travel, with the gains of the rules and then" in said[13]
    assert "makes 7 moves within its travel with these gains, at up to" in said[15]


def test_it_finds_and_verifies_the_axis(done: tuple[Commissioned, Path, list[str]]) -> None:
    found = done[0]
    assert found.verified.met
    assert report.why(found) == ""
    assert found.work[axis.DIRECTION].sign == -1.0
    assert found.model.axis.mass == pytest.approx(PLAIN.mass, rel=0.02)
    assert found.settings.travel.high == pytest.approx(0.1, rel=0.06)
    assert found.model.mode is not None and not found.model.mode.found
    assert "No mode" in " ".join(report.doubts(found, place()))
    # The speed that was allowed is that of the machine and of its verification.
    assert found.settings.guard.speed == OPTIONS.speed > 1.1 * found.settings.motion.velocity
    assert 1.5 * found.settings.motion.velocity > OPTIONS.speed  # which would be the guard's else
    x = found.verified.recording["position"] * 1e-3
    assert abs(x[5:] - x[:-5]).max() / 5e-3 < OPTIONS.speed
    worst = max(abs(m.rest_error or 0.0) for m in found.verified.moves)
    assert worst < found.settings.arrival.tolerance * 1e3


def test_the_machine_s_file_runs(done: tuple[Commissioned, Path, list[str]]) -> None:
    found, out, _ = done
    kind, tree = machine.load(out / report.MACHINE)
    assert kind.name == "axis"
    assert tree == found.settings
    text = (out / report.MACHINE).read_text()
    assert axis.KIND.turned in text
    assert f"mass = {found.model.axis.mass:.4g} +- {found.model.half_width('mass'):.2g}" in text


def test_the_page_tells_all_and_escapes(done: tuple[Commissioned, Path, list[str]]) -> None:
    _, out, _ = done
    page = (out / report.PAGE).read_text()
    assert "an axis &lt;b&gt;" in page
    assert "Verified: all 7 moves arrived" in page
    assert page.count("data:image/png;base64,") == 4
    assert "counts down" in page
    kept = json.loads((out / report.JSON).read_text())
    assert kept["verification"]["met"]
    assert kept["model"]["mass"]["unit"] == "V*s^2/m"
    assert sorted(p.name for p in out.iterdir()) == sorted(
        n for n in report.names(axis.KIND) if not n.endswith((".svg", ".pdf"))
    )


def test_a_commissioning_is_resumed_after_its_last_step(
    done: tuple[Commissioned, Path, list[str]], tmp_path: Path
) -> None:
    for name in ("weight", "direction", "ends"):
        shutil.copy(done[1] / f"{_store.FOLDER}-{name}.json", tmp_path)
    made: list[Virtual] = []
    said: list[str] = []

    def ended() -> bool:
        return "friction over position" in said

    rig = place(made, sign=-1.0)
    with pytest.raises(KeyboardInterrupt):
        commission(rig, OPTIONS, tmp_path, ask=lambda title, _: said.append(title), ended=ended)
    # The ends again, since the encoder's zero is new; and nothing is left on.
    assert said == ["end stops and travel", "friction over position"]
    assert made[0].effort == 0.0
    assert not (tmp_path / f"{_store.FOLDER}-friction.json").exists()


def test_what_was_kept_is_read_back(
    done: tuple[Commissioned, Path, list[str]], tmp_path: Path
) -> None:
    found, out, _ = done
    asked = place().asked(OPTIONS)
    kept = _store.read_steps(out, axis.KIND, asked)
    assert kept[axis.DIRECTION] == found.work[axis.DIRECTION]
    assert kept[axis.FRICTION] == found.work[axis.FRICTION]
    both = [(kept[k], found.work[k]) for k in (axis.STROKES, axis.MODES)]
    for one, other in (pair for two in both for pair in zip(*two, strict=True)):
        assert (one.x == other.x).all() and (one.u == other.u).all()
    with pytest.raises(InputError, match="effort"):
        _store.read_steps(out, axis.KIND, place().asked(OPTIONS._replace(effort=7.0)))
    (tmp_path / f"{_store.FOLDER}-weight.json").write_text("{")
    with pytest.raises(InputError, match="damaged"):
        _store.read_steps(tmp_path, axis.KIND, asked)
    assert _store.read_steps(tmp_path / "none", axis.KIND, asked) == {}


@pytest.mark.parametrize(
    ("options", "match"),
    [
        (OPTIONS._replace(effort=0.0), "--effort"),
        (OPTIONS._replace(speed=float("nan")), "--speed"),
        (OPTIONS._replace(creep=2.0), "--creep"),
        (OPTIONS._replace(low=-0.01), "both, or none"),
        (OPTIONS._replace(low=0.01, high=0.02), "excludes the present position"),
    ],
)
def test_options_are_checked_before_anything_moves(options: Options, match: str) -> None:
    made: list[Virtual] = []
    with pytest.raises(InputError, match=match):
        commission(place(made), options)
    assert not made


def test_options_of_an_axis_that_turns_are_told_in_degrees() -> None:
    with pytest.raises(InputError, match="--creep: '90 deg/s'; accepted: at most --speed 10 deg/s"):
        Options(5.0, math.radians(10.0), math.radians(90.0), 1.0).checked(ANGLE)
    with pytest.raises(ProblemError, match="from 90 deg to 180 deg excludes"):
        Options(5.0, 1.0, 0.1, 1.0, low=math.pi / 2.0, high=math.pi).checked(ANGLE)


def test_a_kind_whose_steps_find_no_direction_has_that_of_its_encoder() -> None:
    kind = axis.KIND
    found = {step.name: object() for step in kind.steps}
    assert sign(kind, Work(None, Options(5.0, 1.0, 0.1, 1.0), found)) == 1.0  # type: ignore[arg-type]


def test_a_named_window_is_not_left() -> None:
    made: list[Virtual] = []
    rig = place(made).make(0)
    options = OPTIONS._replace(low=-0.02, high=0.05)
    work = Work(Stand(session(rig), 1e-3, 1e-5), options)
    procedure.perform(axis.KIND, work, lambda step, intent: None, lambda step, found: None)
    assert not work[axis.ENDS].found
    low, high = made[0].reached
    assert low > -0.0205 and high < 0.0505


def test_how_robust_the_gains_are_is_computed_once(again: Callable[..., Again]) -> None:
    asked: list[Any] = []

    def margins(tree: Any, model: Any) -> procedure.Robustness:
        asked.append((tree, model))
        return procedure.Robustness((("a margin", "2", ">= 1", "dB"),), ("look at this",))

    more = again(margins=margins, tune=None)
    found = more.found()
    page = more.page(found)
    assert asked == [(found.settings, found.model)]
    assert "look at this" in page
    kept = json.loads((more.out / report.JSON).read_text())
    assert kept["margins"] == [["a margin", "2", ">= 1", "dB"]]


def test_margins_and_a_search_that_fail_do_not_cost_what_was_found(
    again: Callable[..., Again],
) -> None:
    def margins(tree: Any, model: Any) -> procedure.Robustness:
        raise ArithmeticError("no such plant")

    def tune(tree: Any, model: Any, progress: procedure.Progress) -> procedure.Tuned:
        raise ArithmeticError("no gains")

    more = again(margins=margins, tune=tune)
    found = more.found()
    assert found.verified.met and found.margins.rows == () and found.tuned.gains == {}
    page = more.page(found)
    assert "could not be computed (ArithmeticError: no such plant)" in page
    assert "better gains failed (ArithmeticError: no gains)" in page


def test_gains_of_a_search_are_verified_told_and_in_the_file(again: Callable[..., Again]) -> None:
    """They come before the verification, from the settings with the tolerance of the rehearsal."""
    seen: list[Any] = []

    def tune(tree: Any, model: Any, progress: procedure.Progress) -> procedure.Tuned:
        seen.append(tree)
        progress(1, 0.0)
        rows = (("a gain", "41", "30 by the rules", "1/s"),)
        return procedure.Tuned({"controller.position": '"41 1/s"'}, rows)

    more = again(tune=tune, compare=None, rehearse=lambda machine, tree: 3e-4)
    found = more.found()
    page = more.page(found)
    (before,) = seen
    assert before.arrival.tolerance == found.settings.arrival.tolerance == 3e-4
    assert before.controller.position != found.settings.controller.position == 41.0
    assert found.verified.met
    assert machine.load(more.out / report.MACHINE)[1].controller.position == 41.0
    assert "30 by the rules" in page
    assert json.loads((more.out / report.JSON).read_text())["tuned"][0][0] == "a gain"


def searched(path: str, value: str) -> Any:
    def tune(tree: Any, model: Any, progress: procedure.Progress) -> procedure.Tuned:
        rows = (("a gain", value, "another by the rules", "1/s"),)
        return procedure.Tuned({path: f'"{value} 1/s"'}, rows)

    return tune


@pytest.mark.slow
def test_gains_by_which_the_stage_itself_settles_later_are_left_out(
    done: tuple[Commissioned, Path, list[str]], again: Callable[..., Again]
) -> None:
    """Whatever a model said: a tenth of the rules' gains is slow on the axis."""
    slow = f"{0.1 * done[0].settings.controller.position:.3g}"
    more = again(tune=searched("controller.position", slow))
    found = more.found(done=lambda title: more.asked.append(f"{title} done"))
    assert [s.removesuffix(" done") for s in more.titles()[-5:]] == [
        running.TUNE,
        *2 * [running.COMPARE],
        *2 * [running.VERIFY],
    ]
    intent = more.asked[-4]
    assert "creeps to its low end and makes 8 moves" in intent and "and 8 V" in intent
    assert found.verified.met and found.tuned.gains == {}
    assert found.settings.controller.position > 5.0 * float(slow)
    ((what, rules, search, unit),) = found.tuned.rows
    assert what == "settling on the stage" and unit == "ms"
    assert float(rules) < 0.5 * float(search.split()[0])
    assert search in more.page(found)


def test_both_gains_are_judged_from_the_same_place_and_by_the_same_tolerance(
    again: Callable[..., Again],
) -> None:
    """Of a commissioning that is resumed after its last step, too; an end ends it there."""
    seen: list[Any] = []

    def compare(stand: Stand, chosen: machine.Machine, tree: Any) -> tuple[float, str]:
        seen.append((stand.position(), tree))
        # Moves end anywhere, and the effort with them.
        law = Creep(1.0, 0.04, 2.0, stand.dt, stand.position() + 0.02)
        stand.drive(law, 2.0, OPTIONS.caution(1.0))
        return 1.0 / len(seen), ""

    tune = searched("controller.position", "41")
    found = again(tune=tune, compare=compare).found()
    (first, rules), (second, search) = seen
    assert abs(first - second) < 5e-4
    assert rules.arrival == search.arrival and rules.travel.high > 0.05
    assert rules.controller.position != 41.0 and search.controller.position == 41.0
    assert found.settings.controller.position == 41.0
    assert found.tuned.rows[0][1:3] == ("500", "1000 ms by the rules")

    # Resumed, neither is tried again; other gains than those are.
    more = again(tune=tune, compare=compare)
    resumed = more.found()
    assert more.titles() == ["end stops and travel", running.VERIFY] and len(seen) == 2
    assert resumed.tuned == found.tuned
    rigs: list[Virtual] = []
    more = again(rigs, tune=searched("controller.position", "42"), compare=compare)
    with pytest.raises(KeyboardInterrupt):
        more.found(ended=lambda: running.COMPARE in more.titles())
    assert more.titles()[-1] == running.COMPARE and rigs[0].effort == 0.0


def test_gains_of_a_search_that_are_not_verified_give_way_to_the_rules(
    again: Callable[..., Again],
) -> None:
    """By 1 1/s no move is over when its patience is; the page says so."""
    more = again(tune=searched("controller.position", "1"), compare=None)
    found = more.found()
    page = more.page(found)
    assert found.verified.met and found.tuned.gains == {}
    assert more.titles().count(running.VERIFY) == 2
    assert machine.load(more.out / report.MACHINE)[1].controller.position > 2.0
    assert "of 7 moves of the verification arrived" in page


def test_a_search_that_is_ended_ends_the_commissioning(again: Callable[..., Again]) -> None:
    wanted: list[bool] = []

    def slow(tree: Any, model: Any, progress: procedure.Progress) -> procedure.Tuned:
        wanted.append(True)
        progress(1, 0.0)
        raise AssertionError("it goes on")

    with pytest.raises(KeyboardInterrupt):
        again(tune=slow).found(ended=lambda: bool(wanted))
