"""What is refused before the first variant, and what the folder says of a sweep."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from macromicro import __version__
from macromicro.errors import InputError
from macromicro.sampling import drawn_by
from macromicro.sweeps import folder, run
from macromicro.sweeps._origin import code
from macromicro.sweeps.work import SweepError

Make = Callable[..., Path]


def checked(spec: Path, out: Path | None = None, **how: object) -> run.Ready:
    return run.check(run.Request(spec, out, factory="sweep_fake:job", **how))  # type: ignore[arg-type]


def swept(spec: Path, out: Path, **how: object) -> run.Outcome:
    ready = checked(spec, out, workers=1, **how)
    return run.execute(ready, lambda *_: None, lambda *_: None, lambda: False, [("a", "b")])


def files(out: Path) -> dict[str, bytes]:
    return {str(p.relative_to(out)): p.read_bytes() for p in out.rglob("*") if p.is_file()}


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished sweep of 10 variants beside its spec."""
    place = tmp_path_factory.mktemp("done")
    (place / "spec.toml").write_text(
        'job = "fake"  # a word\nmethod = "lhs"\nsamples = 10\n[options]\nleast = 3\n'
        "[parameters]\ngain = { low = 1, high = 5 }\n"
        'part.force = ["1 mN", "2 mN"]\n',
        encoding="utf-8",
    )
    swept(place / "spec.toml", place / "out")
    return place


def test_the_spec_is_kept_as_it_was_given(done: Path) -> None:
    assert (done / "out" / "sweep.toml").read_bytes() == (done / "spec.toml").read_bytes()


def test_the_summary(done: Path) -> None:
    told = json.loads((done / "out" / "sweep.json").read_text())
    assert told["state"] == "complete" and told["version"] == __version__
    assert told["spec"]["parameters.gain"] == [1.0, 5.0, "linear"]
    assert told["results"]["rows"] == 10 and told["results"]["impossible"] == 5
    assert told["results"]["first_impossible"].startswith("variant ")
    assert told["results"]["metrics"]["product"]["unit"] == "kg"
    assert told["results"]["metrics"]["noise"]["finite"] == 5
    assert told["software"] == {"a": "b"}
    assert told["sources"] == code().sources


def test_units_stand_in_the_fields(done: Path) -> None:
    schema = pq.read_schema(done / "out" / "results.parquet")
    assert schema.names == ["index", "gain", "part.force", "product", "noise", "often", "error"]
    assert schema.field("part.force").metadata == {b"unit": b"N"}
    product = schema.field("product").metadata
    assert product == {b"unit": b"kg", b"meaning": b"all parameters multiplied"}
    assert json.loads(schema.metadata[b"macromicro.sweep"])["job"] == "fake"
    assert schema.metadata[b"macromicro.version"].decode() == __version__
    assert schema.metadata[b"macromicro.sources"].decode() == code().sources


def test_chosen_metrics_only(make: Make, tmp_path: Path) -> None:
    spec = make(5)
    spec.write_text('metrics = ["often", "product"]\n' + spec.read_text())
    swept(spec, tmp_path / "out")
    table = pq.read_table(tmp_path / "out" / "results.parquet")
    assert table.column_names[3:] == ["often", "product", "error"]
    assert table["often"].to_pylist()[1:] == [1.0, 2.0, 3.0, 4.0]


def test_a_finished_folder_is_not_touched_without_being_asked(done: Path) -> None:
    before = files(done / "out")
    with pytest.raises(InputError, match=r"already exists.*--resume or --overwrite"):
        swept(done / "spec.toml", done / "out")
    outcome = swept(done / "spec.toml", done / "out", resume=True)
    assert outcome.before == 10 and outcome.written is not None
    assert outcome.written.impossible == 5
    assert files(done / "out") == before


CHANGES = {
    "parameters.gain": ("high = 5", "high = 6"),
    "samples": ("samples = 10", "samples = 11"),
    "method": ('"lhs"', '"sobol"'),
    "options.least": ("least = 3", "least = 4"),
    "seed": ("samples = 10", "samples = 10\nseed = 3"),
    "parameters.part.mass": ("part.force", "part.mass = '1 kg'\npart.force"),
    "metrics": ("samples = 10", "samples = 10\nmetrics = ['noise']"),
}


@pytest.mark.parametrize("key", CHANGES)
def test_another_spec_is_not_gone_on_with(done: Path, tmp_path: Path, key: str) -> None:
    """The message names the key and both values."""
    before = files(done / "out")
    other = tmp_path / "other.toml"
    other.write_text((done / "spec.toml").read_text().replace(*CHANGES[key]))
    with pytest.raises(InputError) as caught:
        swept(other, done / "out", resume=True)
    assert caught.value.where == f"--out {done / 'out'}, {key}"
    assert "--overwrite" in caught.value.accepted and caught.value.exit_status == 2
    assert files(done / "out") == before


def test_another_version_is_not_gone_on_with(make: Make, tmp_path: Path) -> None:
    spec, out = make(5), tmp_path / "out"
    checked(spec, out)
    told = json.loads((out / "sweep.json").read_text())
    folder.write_json(out / "sweep.json", {**told, "version": "0.0.1"})
    with pytest.raises(InputError, match=r"macromicro 0\.0\.1.*Install that version.*--overwrite"):
        checked(spec, out, resume=True)


def test_other_sources_of_the_same_version_are_not_gone_on_with(make: Make, tmp_path: Path) -> None:
    """Results of two codes never stand in one file, finished or not."""
    spec, out = make(5), tmp_path / "out"
    checked(spec, out)
    checked(spec, out, resume=True)
    told = json.loads((out / "sweep.json").read_text())
    folder.write_json(out / "sweep.json", {**told, "sources": "abc"})
    with pytest.raises(InputError, match=r"sources: .*abc.*Restore them.*--overwrite") as caught:
        checked(spec, out, resume=True)
    assert caught.value.exit_status == 2
    swept(spec, out, overwrite=True)
    assert json.loads((out / "sweep.json").read_text())["sources"] == code().sources


@pytest.mark.parametrize("drew", [None, "scipy 1.0.0"])
def test_points_of_another_sampler_are_not_gone_on_with(
    make: Make, tmp_path: Path, drew: str | None
) -> None:
    """Another scipy may draw other points; folders of before name none, and drew their own."""
    spec, out = make(5), tmp_path / "out"
    checked(spec, out)
    told = json.loads((out / "sweep.json").read_text())
    assert told.pop("sampler") == code().sampler == drawn_by()
    before = {**told, "sampler": drew} if drew else {**told, "digest": "0", "sources": "0"}
    folder.write_json(out / "sweep.json", before)
    with pytest.raises(InputError, match=r"sampler: begun with .*--overwrite") as caught:
        checked(spec, out, resume=True)
    assert caught.value.exit_status == 2
    assert (drew or "of an earlier version") in str(caught.value)
    assert json.loads((out / "sweep.json").read_text()) == before


def test_workers_of_changed_sources_end_it(make: Make, tmp_path: Path) -> None:
    """They start when files may have changed since the sweep was checked."""
    ready = checked(make(5), tmp_path / "out", workers=1)
    other = code()._replace(sources="abc")
    ready = ready._replace(task=ready.task._replace(code=other))
    with pytest.raises(SweepError, match=r"a worker has macromicro .*, this sweep is of .*abc"):
        run.execute(ready, lambda *_: None, lambda *_: None, lambda: False)
    assert not (tmp_path / "out" / "results.parquet").exists()


def free(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    """A disk with so many bytes free."""
    usage = shutil.disk_usage("/")._replace(free=count)
    monkeypatch.setattr(shutil, "disk_usage", lambda place: usage)


def test_resume_looks_at_the_disk_for_what_is_missing(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All where nothing exists yet; without the finished variants' journal where they do."""
    spec, out = make(40, block=4), tmp_path / "out"
    ready = checked(spec, out, workers=1)
    sweep, before = ready.task.spec, 0
    whole = folder.needed_bytes(sweep, 40)
    free(monkeypatch, whole - 1)
    with pytest.raises(InputError, match="MB free"):
        checked(spec, tmp_path / "new", resume=True)
    assert not (tmp_path / "new").exists()
    with pytest.raises(InputError, match="MB free") as caught:
        swept(spec, out, resume=True)
    assert caught.value.exit_status == 2
    free(monkeypatch, whole)

    def report(variants: int, impossible: int) -> None:
        nonlocal before
        before += variants

    run.execute(ready, lambda *_: None, report, lambda: before >= 8)
    assert 8 <= before < 40
    free(monkeypatch, folder.needed_bytes(sweep, 40 - before) - 1)
    with pytest.raises(InputError, match="MB free"):
        swept(spec, out, resume=True)
    free(monkeypatch, folder.needed_bytes(sweep, 40 - before))
    assert swept(spec, out, resume=True).before == before
    free(monkeypatch, 0)
    assert swept(spec, out, resume=True).before == 40


def test_overwrite_replaces(done: Path, make: Make, tmp_path: Path) -> None:
    out = tmp_path / "out"
    swept(make(6), out)
    (out / "mine.txt").write_text("kept")
    swept(make(9, "other.toml"), out, overwrite=True)
    assert pq.read_table(out / "results.parquet").num_rows == 9
    assert (out / "mine.txt").read_text() == "kept"
    assert (out / "sweep.toml").read_text() == (tmp_path / "other.toml").read_text()


def test_resume_of_nothing_begins(make: Make, tmp_path: Path) -> None:
    """So that one command line serves the first and every later try."""
    assert swept(make(6), tmp_path / "out", resume=True).done == 6


def test_resume_in_a_folder_of_something_else(make: Make, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("mine")
    with pytest.raises(InputError, match="already exists"):
        checked(make(5), tmp_path / "out", resume=True)
    (tmp_path / "out" / "sweep.json").write_text("{}")
    with pytest.raises(InputError, match="not part of a sweep"):
        checked(make(5), tmp_path / "out", resume=True)
    (tmp_path / "out" / "sweep.json").unlink()
    (tmp_path / "out" / "journal").write_text("a file")
    with pytest.raises(InputError, match="not part of a sweep"):
        checked(make(5), tmp_path / "out", overwrite=True)
    assert (tmp_path / "out" / "thesis.tex").read_text() == "mine"


@pytest.mark.parametrize(
    "how, words",
    [
        ({"resume": True, "overwrite": True}, "--resume: not allowed with --overwrite"),
        ({"workers": 2, "scheduler": "tcp://a:1"}, "--workers: not allowed with --scheduler"),
        ({"workers": 0}, "--workers: 0; accepted: a whole number from 1"),
        ({"workers": -3}, "--workers: -3; accepted: a whole number from 1"),
    ],
)
def test_options_that_cannot_be(
    make: Make, tmp_path: Path, how: dict[str, object], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        checked(make(5), tmp_path / "out", **how)
    assert not (tmp_path / "out").exists()


def test_places_that_cannot_be(make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="this is a file"):
        checked(make(5), tmp_path / "file")
    with pytest.raises(InputError, match="not a valid"):
        checked(make(5), tmp_path / "a\0b")
    with pytest.raises(InputError, match="MB free"):
        checked(make(10**11), tmp_path / "big")
    monkeypatch.chdir(tmp_path)
    assert checked(make(5)).out == Path("results/spec")


def test_without_pyarrow_the_extra_is_named(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [n for n in sys.modules if n.startswith("pyarrow")]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match=r"checkout: .*-e '\.\[sweep\]'") as caught:
        checked(make(5), tmp_path / "out")
    assert "-e '.[sweep]'" in caught.value.accepted
    assert not (tmp_path / "out").exists()


def test_groups_of_rows_are_of_one_size(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So memory stays bounded, and the file does not depend on who computed what."""
    from macromicro.sweeps import results

    monkeypatch.setattr(results, "GROUP", 16)
    swept(make(50, block=7, least=20.0), tmp_path / "out")
    file = pq.ParquetFile(tmp_path / "out" / "results.parquet")
    sizes = [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)]
    assert sizes == [16, 16, 16, 2]
    table = file.read()
    assert table["index"].to_pylist() == list(range(50))
    impossible = [g < 20.0 for g in table["gain"].to_pylist()]
    assert [w is not None for w in table["error"].to_pylist()] == impossible


def test_a_stop_while_the_results_are_written(make: Make, tmp_path: Path) -> None:
    """Nothing half is left, nothing is computed again."""
    spec, out = make(20, block=4), tmp_path / "out"
    ready, seen = checked(spec, out, workers=1), 0

    def report(variants: int, impossible: int) -> None:
        nonlocal seen
        seen += variants

    outcome = run.execute(ready, lambda *_: None, report, lambda: seen == 20)
    assert (outcome.done, outcome.written) == (20, None)
    assert sorted(p.name for p in out.iterdir()) == ["journal", "sweep.json", "sweep.toml"]
    again = swept(spec, out, resume=True)
    assert again.before == 20 and again.written is not None
