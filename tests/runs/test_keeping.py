"""What a run has learned is a settings file, and the next run begins with it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from macromicro import api
from macromicro.control import outside
from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.report.write import run_report, write
from macromicro.runs import folder, job, keeping
from macromicro.schema.par import changed
from macromicro.serve.settings import load as served
from macromicro.settings import Settings, choose

ROUGH = 15.0  # N, where the shipped bench has 10.5
AFTER, SEEN = 100, 60  # periods


def moved(folder: Path, settings: Settings) -> Recording:
    path = folder / "one.toml"
    path.write_text('[[moves]]\nmacro = ["10 mm"]\nhold = "0.6 s"\n')
    return api.run(path, settings=changed(settings, {"controller.sequence.wait": 0.6}))


def judged(run: Recording) -> tuple[int, float]:
    """Periods until within a count, and the swing 0.1 s later, um."""
    off = np.abs(run["macro_position"] - run["macro_reference"])
    near = int(np.flatnonzero(off > 1.0)[-1]) + 1
    return near, float(np.abs(run["true_belt"][near + AFTER : near + AFTER + SEEN]).max())


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory) -> tuple[Recording, Settings, Path]:
    """A run on a bench that rubs more than the law knows, its settings, and what it learned."""
    place = tmp_path_factory.mktemp("first")
    settings = choose(Settings(), None, "terminal").with_("bench.friction.coulomb", f"{ROUGH} N")
    run = moved(place, settings)
    text = keeping.text(run, settings)
    assert text is not None
    file = place / folder.LEARNED
    file.write_text(text)
    return run, settings, file


def test_the_next_run_begins_where_the_last_one_ended(
    first: tuple[Recording, Settings, Path],
) -> None:
    run, settings, file = first
    found = np.median(run["law_friction"][run["law_speed"] != 0.0])
    again = choose(Settings(), file, None)
    old, new = settings.controller.own, again.controller.own
    assert found > 0.3
    assert new.coulomb == pytest.approx(old.coulomb + found, abs=1e-4)
    assert again.controller.macro_law == "terminal"
    assert new._replace(coulomb=old.coulomb) == old
    assert again.bench == settings.bench


def test_it_is_better_on_a_bench_whose_friction_differs(
    first: tuple[Recording, Settings, Path], tmp_path: Path
) -> None:
    run, _, file = first
    second = moved(tmp_path, choose(Settings(), file, None))
    (late, swing), (soon, little) = judged(run), judged(second)
    assert soon < 0.7 * late
    assert little < 0.2 * swing
    assert second["law_friction"][0] == 0.0
    left = np.median(second["law_friction"][second["law_speed"] != 0.0])
    assert abs(left) < 0.1


def test_the_live_machine_begins_with_it(
    first: tuple[Recording, Settings, Path], tmp_path: Path
) -> None:
    """As from a rig, whose friction is in no file; so rough a bench's homing is refused."""
    run, settings, file = first
    text = keeping.text(run, settings._replace(bench=Settings().bench))
    assert text is not None
    (tmp_path / "mine.toml").write_text(text)
    mine = choose(Settings(), file, None).controller.own
    assert served(tmp_path / "mine.toml").controller.own == mine


@pytest.mark.parametrize(
    ("wrong", "key", "value"),
    [
        ('"-1 V"', "coulomb", "-1"),
        ('"3 N"', "coulomb", "3 N"),
    ],
)
def test_a_bad_file_is_refused_with_key_and_value(
    first: tuple[Recording, Settings, Path], tmp_path: Path, wrong: str, key: str, value: str
) -> None:
    _, _, file = first
    lines = file.read_text().splitlines()
    at = next(k for k, line in enumerate(lines) if "effort that friction takes" in line)
    lines[at] = f"coulomb = {wrong}"
    bad = tmp_path / "bad.toml"
    bad.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError) as refused:
        choose(Settings(), bad, None)
    assert key in refused.value.where
    assert "bad.toml" in refused.value.where
    assert value in str(refused.value.value)


def test_laws_that_keep_nothing_leave_no_file(first: tuple[Recording, Settings, Path]) -> None:
    run, _, _ = first
    assert keeping.text(run, Settings()) is None
    inverse = choose(Settings(), None, "inverse")
    assert outside.law_of_gains(inverse.controller.fine).kept is None
    assert keeping.text(run, inverse) is None


def test_a_run_writes_it_and_takes_an_old_one_away(tmp_path: Path) -> None:
    """A run under another law into the same folder leaves nothing of the last one's."""
    path = tmp_path / "one.toml"
    path.write_text('[[moves]]\nmacro = ["10 mm"]\nhold = "0.1 s"\n')
    out = tmp_path / "out"
    for law, there in (("terminal", True), ("pd-tuned", False)):
        asked = job.check(job.Request(str(path), out, law=law, overwrite=True))
        ended = job.execute(asked)
        write(ended, run_report(ended, "now"))
        assert (out / folder.LEARNED).exists() is there
