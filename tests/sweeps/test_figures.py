"""The figure of a sweep: what is drawn for one, two and more parameters, and from what."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.contour import ContourSet
from sweep_fake import swept

from macromicro.drawing.files import encode
from macromicro.errors import InputError
from macromicro.sweeps import _folder, figures, results
from macromicro.sweeps.results import Quantity, Range, Results, Summary, lines

HEAD = 'job = "fake"\nmethod = "grid"\n[parameters]\n'


def run(folder: Path, text: str) -> Path:
    (folder / "spec.toml").write_text(text, encoding="utf-8")
    swept(folder / "spec.toml", folder / "out")
    return folder / "out"


def made(count: int, rows: int = 50, lost: int = 0) -> Results:
    """A cloud: the last parameter alone decides the metric, and the first `lost` have none."""
    rng = np.random.default_rng(1)
    parameters = tuple(Quantity(f"p{k}", "mm", rng.random(rows)) for k in range(count))
    metric = np.where(np.arange(rows) < lost, np.nan, parameters[-1].values ** 2)
    return Results("job", "random", rows, (), parameters, (Quantity("m", "s", metric),))


def test_a_grid_of_one_parameter_is_a_curve(tmp_path: Path) -> None:
    """In the unit that people read, on the scale of the spec."""
    out = run(tmp_path, HEAD + 'gain = { low = 1, high = 100, steps = 5, scale = "log" }\n')
    found = results.load(out)
    assert (found.job, found.method, found.total, found.shape) == ("fake", "grid", 5, (5,))
    assert found.parameters[0].log and found.metrics[0].name == "product"
    figure = figures.draw(found)
    assert figure is not None and len(figure.axes) == 3
    ax = figure.axes[0]
    np.testing.assert_allclose(ax.lines[0].get_xdata(), [1, 10**0.5, 10, 10**1.5, 100])
    np.testing.assert_allclose(ax.lines[0].get_ydata(), [1, 10**0.5, 10, 10**1.5, 100])
    assert ax.get_xscale() == "log" and figure.axes[-1].get_xlabel() == "gain"
    assert figure.axes[2].get_title(loc="left") == "often; no number for 1 of 5"


def test_a_grid_of_two_is_a_map(tmp_path: Path) -> None:
    """Every cell has its own variant's value; one that is fixed does not count."""
    text = "gain = [3, 1, 2]\npart.mass = ['1 kg', '2 kg', '3 kg', '4 kg']\nteeth = 7\n"
    found = results.load(run(tmp_path, HEAD + text))
    assert [p.name for p in found.parameters] == ["gain", "part.mass"] and found.shape == (3, 4)
    figure = figures.draw(found)
    assert figure is not None
    ax = figure.axes[0]
    (mesh,) = (c for c in ax.collections if hasattr(c, "get_coordinates"))
    expected = 7.0 * np.outer([1, 2, 3], [1, 2, 3, 4])
    np.testing.assert_allclose(np.reshape(mesh.get_array(), (3, 4)), expected)
    assert ax.get_xlabel() == "part.mass [kg]" and ax.get_ylabel() == "gain"
    assert encode(figure).startswith(b"\x89PNG")


def test_noise_has_no_contours() -> None:
    """A plain that differs in the fourth digit beside a cliff: one line, at the cliff."""
    x, y = np.meshgrid(np.arange(20.0), np.arange(20.0), indexing="ij")
    rough = 1.0 + 1e-4 * np.random.default_rng(1).random((20, 20)) + 100.0 * (x > 16.0)
    both = (Quantity("a", "", x.ravel()), Quantity("b", "", y.ravel()))
    figure = figures.draw(
        Results("job", "grid", 400, (20, 20), both, (Quantity("m", "s", rough.ravel()),))
    )
    assert figure is not None
    contours = [c for c in figure.axes[0].collections if isinstance(c, ContourSet)]
    assert [len(c.levels) for c in contours] == [1]
    for path in contours[0].get_paths():
        assert path.vertices[:, 1].min() >= 16.0


def test_more_are_clouds(tmp_path: Path) -> None:
    text = HEAD.replace("grid", "random").replace("[par", "samples = 40\n[par")
    text += "gain = { low = 1, high = 9 }\npart.mass = { low = '1 kg', high = '2 kg' }\n"
    found = results.load(run(tmp_path, text))
    figure = figures.draw(found)
    assert figure is not None and len(figure.axes) == 3 * 2
    x, y = figure.axes[1].lines[0].get_data()
    np.testing.assert_array_equal(x, found.parameters[1].values)
    np.testing.assert_array_equal(y, found.metrics[0].values)


def test_of_many_parameters_those_that_matter_are_drawn() -> None:
    figure = figures.draw(made(9))
    assert figure is not None and len(figure.axes) == 4
    assert figure.axes[-1].get_xlabel() == "p8\n[mm]"
    assert "not shown: 5 parameters" in " ".join(t.get_text() for t in figure.texts)


def test_a_metric_that_is_never_a_number() -> None:
    """Empty panels, and the count."""
    for count in (1, 2, 3, 9):
        figure = figures.draw(made(count, lost=50))
        assert figure is not None and encode(figure)
        assert figure.axes[0].get_title(loc="left") == "m; no number for 50 of 50"
    empty = made(2, rows=12, lost=12)._replace(shape=(3, 4))
    grid = np.meshgrid(np.arange(3.0), np.arange(4.0), indexing="ij")
    both = tuple(Quantity(f"p{k}", "", g.ravel()) for k, g in enumerate(grid))
    figure = figures.draw(empty._replace(parameters=both))
    assert figure is not None and encode(figure)


def test_nothing_varies(tmp_path: Path) -> None:
    """No figure, and none of an earlier sweep."""
    out = run(tmp_path, HEAD + "gain = 3\n")
    (out / "sweep.svg").write_text("of an earlier one")
    assert figures.save(out) == [] and not (out / "sweep.svg").exists()


@pytest.mark.slow
def test_saved_are_the_formats_asked_for(tmp_path: Path) -> None:
    out = run(tmp_path, HEAD + "gain = [1, 2]\n")
    for kinds in (("png", "svg"), ("pdf",)):
        assert [p.suffix[1:] for p in figures.save(out, kinds)] == list(kinds)
    assert [p.name for p in out.glob("sweep.[!jt]*")] == ["sweep.pdf"]


def test_millions_are_read_in_part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And then they are no map, but a cloud, which says so."""
    monkeypatch.setattr(_folder, "GROUP", 4)
    monkeypatch.setattr(results, "MAX_CELLS", 60)
    levels = ", ".join(str(k) for k in range(1, 7))
    out = run(tmp_path, HEAD + f"gain = [{levels}]\nteeth = [{levels}]\n")
    found = results.load(out)
    assert found.total == 36 and len(found.metrics[0].values) == 12 and found.shape == ()
    figure = figures.draw(found)
    assert figure is not None and "12 of 36 variants" in str(figure.get_suptitle())


@pytest.mark.parametrize("content", [None, b"", b"PAR1 no", "other"])
def test_what_is_no_sweep(content: bytes | str | None, tmp_path: Path) -> None:
    if content == "other":
        import pyarrow as pa
        import pyarrow.parquet as pq

        pq.write_table(pa.table({"a": [1]}), tmp_path / "results.parquet")
    elif isinstance(content, bytes):
        (tmp_path / "results.parquet").write_bytes(content)
    with pytest.raises(InputError, match="Give the folder of a finished sweep"):
        results.load(tmp_path)


def test_ranges_of_the_metrics() -> None:
    metrics = {"a": Range("s", 10, 1.0, 2.0, 3.0), "b": Range("", 7, -1.0, 0.5, 2.0)}
    summary = Summary(10, 2, "", {**metrics, "c": Range("m", 0)})
    assert list(lines(summary)) == [
        "a  1 to 3 s, mean 2",
        "b  -1 to 2, mean 0.5, a number in 7 of 10",
        "c  no finite value",
    ]
    assert summary.as_json()["metrics"]["c"] == {"unit": "m", "finite": 0}


def test_few_rows_do_not_choose_what_is_drawn() -> None:
    """Nine of them: no rank correlation is known, and the first parameters are drawn."""
    figure = figures.draw(made(9, rows=9))
    assert figure is not None and figure.axes[-1].get_xlabel() == "p3\n[mm]"
