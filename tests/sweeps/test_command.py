"""``macromicro sweep`` as a person calls it, with the real jobs."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from macromicro import batch, cli
from macromicro.sweeps._sampling import Sampler
from macromicro.sweeps._spec import load

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "tuning.md").read_text(encoding="utf-8").partition("\n## Sweeps\n")[2]


def called(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["macromicro", "sweep", *map(str, words)])
    return cli.main()


def block(language: str) -> str:
    (found,) = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return str(found)


def test_the_spec_of_the_page_loads(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text("[controller]\nmacro_law = 'pid'\n")
    (tmp_path / "spec.toml").write_text(block("toml"))
    spec, _ = load(tmp_path / "spec.toml", batch.job)
    names = [axis.path.rpartition(".")[2] for axis in spec.axes]
    assert names == ["coulomb", "bristle", "frequency"]
    assert spec.variants == 300 and spec.metrics == ("settling_time",)


@pytest.mark.slow
def test_an_example_gives_what_the_job_gives(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In processes and parts: the same bits as one evaluation here; the page reads them."""
    text = (ROOT / "examples/sweep-gains.toml").read_text().replace("steps = 40", "steps = 18")
    example, out = tmp_path / "sweep-gains.toml", tmp_path / "results/sweep-gains"
    example.write_text(text)
    assert called(monkeypatch, example, "--out", out, "--workers", 2) == 0
    said = capsys.readouterr()
    spec = load(example, batch.job)[0]
    assert "computed: 324 of 324 variants" in said.out
    last = [f"results: {out}/results.parquet", f"figure: {out}/sweep.png"]
    assert said.out.splitlines()[-2:] == last
    assert said.err.startswith(f"{spec.job}: 324 variants, 0 finished before")
    table = pq.read_table(out / "results.parquet")
    job = batch.job(spec.job, **dict(spec.options))
    expected = job.evaluate(Sampler(spec).variants(304, 20), 304)[:, list(spec.columns)]
    for k, name in enumerate(spec.metrics):
        assert np.array_equal(table[name].to_numpy()[304:], expected[:, k], equal_nan=True), name
    assert called(monkeypatch, "--show", out, "--figures", "svg,pdf") == 0
    assert {p.name for p in out.glob("sweep.[!t]*")} == {"sweep.svg", "sweep.pdf"}
    shown = [f"figure: {out}/sweep.{kind}" for kind in ("svg", "pdf")]
    assert capsys.readouterr().out.splitlines() == shown
    assert called(monkeypatch, example, "--out", out) == 2
    assert "already exists" in capsys.readouterr().err
    assert called(monkeypatch, example, "--out", out, "--resume") == 0
    assert "computed: 0 of 324" in capsys.readouterr().out
    monkeypatch.chdir(tmp_path)
    exec(block("python"), {})
    times = [float(t) for t in re.findall(r"'settling_time': ([\d.]+)", capsys.readouterr().out)]
    assert len(times) == 5 and times == sorted(times)


def test_the_jobs_and_a_job_s_parameters(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(monkeypatch, "--list") == 0
    said = capsys.readouterr().out
    for name in batch.JOBS:
        assert f"{name}: " in said
    assert called(monkeypatch, "macro-bench", "--list") == 0
    said = capsys.readouterr().out
    assert "  controller.motor_limit = 5 V: largest effort of the macro law" in said
    assert "  settling_time [s]: " in said


@pytest.mark.parametrize(
    "words, found",
    [
        ((), "no file given"),
        (("--show",), "no file given"),
        (("--show", "nowhere"), "nowhere/results.parquet: no such file"),
        (("--show", "nowhere", "--figures", "gif"), "--figures: 'gif'"),
        (("none.toml",), "no such file"),
        (("rocket", "--list"), "rocket"),
        (("none.toml", "--workers", "0"), "--workers: 0"),
        (("none.toml", "--resume", "--overwrite"), "not allowed with --overwrite"),
    ],
)
def test_bad_input_is_one_line_and_2(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: tuple[str, ...],
    found: str,
) -> None:
    assert called(monkeypatch, *words) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1 and found in said[0]


def test_infeasible_variants_are_counted_and_the_first_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A step of 3 counts has no settling; when all are so, the status is 1."""
    spec = tmp_path / "steps.toml"
    spec.write_text('job = "macro-bench"\n[parameters]\nreference = ["3 counts", "100 counts"]\n')
    assert called(monkeypatch, spec, "--out", tmp_path / "a", "--workers", 1) == 0
    assert "infeasible: 1 of 2; variant 0, reference" in capsys.readouterr().out
    spec.write_text('job = "macro-bench"\n[parameters]\nreference = ["3 counts", "4 counts"]\n')
    assert called(monkeypatch, spec, "--out", tmp_path / "b", "--workers", 1) == 1
    assert "every variant is infeasible" in capsys.readouterr().err


REFERENCES = """
job = "macro-bench"
metrics = ["settling_time", "final_error"]
options = { length = 2 }
[parameters]
reference = ["700 counts", "2800 counts"]
"""


def test_the_step_of_macro_bench_is_a_parameter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Beside the tree's, as the job takes it: the same bits as with the option."""
    assert called(monkeypatch, "macro-bench", "--list") == 0
    assert "  reference = 2800 count: step" in capsys.readouterr().out
    (tmp_path / "steps.toml").write_text(REFERENCES)
    assert called(monkeypatch, tmp_path / "steps.toml", "--out", tmp_path, "--workers", 1) == 2
    capsys.readouterr()
    out = tmp_path / "out"
    assert called(monkeypatch, tmp_path / "steps.toml", "--out", out, "--workers", 1) == 0
    assert "no metric varies" not in capsys.readouterr().err
    table = pq.read_table(out / "results.parquet")
    for row, counts in enumerate((700.0, 2800.0)):
        job = batch.job("macro-bench", reference=counts, length=2.0)
        friction = job.base().bench.friction.coulomb
        same = batch.Variants(("bench.friction.coulomb",), np.array([[friction]]))
        names = [m.name for m in job.metrics]
        expected = job.evaluate(same)[0, names.index("settling_time")]
        assert table["settling_time"][row].as_py() == expected


def test_a_parameter_that_the_job_does_not_use_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The room's temperature is one of the bench's, but nothing to the macro-stage."""
    spec = tmp_path / "rooms.toml"
    text = REFERENCES.replace("reference = ", "bench.thermal.ambient = ")
    spec.write_text(text.replace("700 counts", "20 degC").replace("2800 counts", "30 degC"))
    assert called(monkeypatch, spec, "--out", tmp_path / "out", "--workers", 1) == 0
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == ("macromicro: no metric varies; does macro-bench use bench.thermal.ambient?")


HEAVY = ("dask", "distributed", "numba", "pyarrow", "scipy")


def test_help_loads_nothing_heavy() -> None:
    script = (
        "import sys\nfrom macromicro.cli import main\nsys.argv = ['macromicro', 'sweep', '--help']"
        f"\nmain()\nprint([n for n in {HEAVY!r} if n in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "--scheduler" in done.stdout and done.stdout.splitlines()[-1] == "[]"
