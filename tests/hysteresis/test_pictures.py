"""The staircase and the pictures (Figures 2.12-2.18, 5.7)."""

from __future__ import annotations

import io
import subprocess
import sys

import numpy as np
import pytest

from macromicro.hysteresis import FodTable, Preisach, from_density
from macromicro.hysteresis.pictures import _evenly, draw_curves, draw_density, draw_plane, staircase

TABLE = FodTable.from_everett(from_density(np.tril(np.ones((20, 20))), -1.0, 0.1, 21), 0.0, 2.0)


def test_staircase_of_figures_2_13_to_2_16() -> None:
    model = Preisach(TABLE)
    model.step(0.6)  # u1: one horizontal link
    assert [side.tolist() for side in staircase(model)] == [[-1.0, 0.6], [0.6, 0.6]]
    model.step(-0.4)  # u2: a vertical one, vertex at (u1, u2)
    assert [side.tolist() for side in staircase(model)] == [[-1.0, -0.4], [0.6, 0.6]]
    model.step(0.2)  # u3 < u1
    assert [s.tolist() for s in staircase(model)] == [[-1, -0.4, -0.4, 0.2], [0.6, 0.6, 0.2, 0.2]]
    model.step(-0.1)  # u4 > u2: a new vertex at (u3, u4)
    assert [s.tolist() for s in staircase(model)] == [[-1, -0.4, -0.4, -0.1], [0.6, 0.6, 0.2, 0.2]]


@pytest.mark.parametrize("start", ["negative", "positive", "demagnetised"])
def test_area_under_the_staircase_is_the_output(start: str) -> None:
    """Uniform density: f is the area of S+ (2.4), here of a triangle of area 2."""
    table = FodTable.from_everett(from_density(lambda a, b: 1.0 + 0.0 * a, -1.0, 0.02, 101), 0, 2)
    model = Preisach(table)
    model.reset(start)  # type: ignore[arg-type]
    for u in (0.6, -0.4, 0.2, -0.1):
        model.step(u)
        beta, alpha = staircase(model)
        x, y = np.r_[beta, model.u, -1.0], np.r_[alpha, model.u, -1.0]
        area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        assert model.f == pytest.approx(area, abs=1e-9)


def test_pictures_can_be_saved() -> None:
    model = Preisach(TABLE)
    for u in (0.6, -0.4, 0.2, -0.1):
        model.step(u)
    u = np.linspace(0.5, -1.0, 30)
    fitted = FodTable.from_curves(
        [
            (s + (u - 0.5) * (s + 1.0) / 1.5, TABLE.curve(s, s + (u - 0.5) * (s + 1.0) / 1.5))
            for s in (-0.2, 0.4, 1.0)
        ],
        nodes=21,
    )
    pictures = [draw_plane(model, "V"), draw_density(TABLE), draw_density(fitted, "V")]
    pictures += [draw_curves(TABLE, most=4), draw_curves(fitted, "V", "mm")]
    for figure in pictures:
        file = io.BytesIO()
        figure.savefig(file, format="png")
        assert file.getvalue().startswith(b"\x89PNG")
    lines = pictures[3].axes[0].lines
    assert len(lines) == 4 + 2
    assert pictures[4].axes[0].get_xlabel() == "input u [V]"


def test_heavy_modules_wait_until_they_are_needed() -> None:
    code = (
        "import sys, macromicro.hysteresis, macromicro.hysteresis.forc, "
        "macromicro.hysteresis.table_files, macromicro.hysteresis.pictures\n"
        "print([m for m in ('scipy', 'matplotlib', 'h5py', 'numba') if m in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


@pytest.mark.parametrize(("count", "most"), [(0, 5), (1, 5), (5, 5), (4, 9), (100, 7), (3, 2)])
def test_of_many_curves_some_are_drawn_the_first_and_the_last_among_them(
    count: int, most: int
) -> None:
    found = _evenly(count, most)
    assert len(found) == min(count, most) and found == sorted(set(found))
    if count:
        assert found[0] == 0 and found[-1] == (count - 1 if most > 1 else 0)
        assert np.ptp(np.diff(found)) <= 1 if len(found) > 1 else True


def test_the_plane_shows_the_vertices_with_their_numbers() -> None:
    """Those of Figure 2.16, and S+ below the line between them."""
    model = Preisach(TABLE)
    for u in (0.6, -0.4, 0.2, -0.1):
        model.step(u)
    axes = draw_plane(model, "V").axes[0]
    assert axes.get_title(loc="left") == "Preisach plane at u = -0.1 V"
    line, edge, dots = axes.lines
    assert line.get_xydata().tolist() == [[-1, 0.6], [-0.4, 0.6], [-0.4, 0.2], [-0.1, 0.2],
                                          [-0.1, -0.1]]  # fmt: skip
    assert edge.get_xydata().tolist() == [[-1, -1], [1, 1], [-1, 1], [-1, -1]]
    assert dots.get_xydata().tolist() == [[-0.4, 0.6], [-0.1, 0.2]]
    shown = [(t.get_text(), *t.xy) for t in axes.texts]
    assert shown == [("$(M_1, m_1)$", -0.4, 0.6), ("$(M_2, m_2)$", -0.1, 0.2)]
    half, up = (patch.get_xy().tolist() for patch in axes.patches)
    assert half[:3] == [[-1, -1], [1, 1], [-1, 1]]
    assert up[:6] == [*line.get_xydata().tolist(), [-1, -1]]


@pytest.mark.parametrize(("pairs", "told"), [(7, 7), (8, 0)])
def test_of_many_vertices_none_is_numbered(pairs: int, told: int) -> None:
    model = Preisach(TABLE)
    for k in range(pairs):
        model.step(0.9 - 0.05 * k)
        model.step(-0.9 + 0.05 * k)
    axes = draw_plane(model).axes[0]
    assert len(axes.texts) == told and len(axes.lines[2].get_xdata()) == pairs


def test_a_density_is_shown_to_what_nearly_all_cells_have() -> None:
    """Cells of 1 to 210 in some order: 99.5 % are below 208.955; the sign is that of the loop."""
    weights = np.zeros((20, 20))
    weights[np.tri(20, dtype=bool)] = np.random.default_rng(2).permutation(210) + 1.0
    table = FodTable.from_everett(from_density(weights, -1.0, 0.1, 21), 0.0, float(weights.sum()))
    for f_high in (1.0, -1.0):
        turned = FodTable(-1.0, 0.1, f_high * table.values, 0.0)
        mesh = draw_density(turned).axes[0].collections[0]
        shown = np.abs(table.density[np.isfinite(table.density)])
        most = float(np.quantile(shown, 0.995))
        assert mesh.get_clim() == pytest.approx((-most, most))
        found = np.ma.filled(mesh.get_array(), np.nan)
        np.testing.assert_allclose(found, table.density)


def test_without_raw_curves_those_of_grid_lines_are_shown() -> None:
    """Of a descending table from each down to the lowest input, and the major loop over them."""
    axes = draw_curves(TABLE, "V", "mm", most=3).axes[0]
    *curves, rising, falling = axes.lines
    assert [c.get_xdata()[0] for c in curves] == pytest.approx([-1.0, 0.0, 1.0])
    assert [c.get_xdata()[-1] for c in curves] == pytest.approx([-1.0, -1.0, -1.0])
    for c in curves:
        start = float(c.get_xdata()[0])
        np.testing.assert_allclose(c.get_ydata(), TABLE.curve(start, c.get_xdata()))
    np.testing.assert_allclose(rising.get_ydata(), TABLE.major_loop[1])
    np.testing.assert_allclose(falling.get_ydata(), TABLE.major_loop[2])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("input u [V]", "output f [mm]")


def test_raw_curves_are_shown_with_those_of_the_table_from_the_same_start() -> None:
    """Rows that are no numbers have no start."""
    raw = ((np.array([np.nan, 0.5, -1.0]), np.array([1.0, 1.0, 0.0])),
           (np.array([0.9, 0.8, -1.0]), np.array([np.nan, 1.5, 0.0])))  # fmt: skip
    down = FodTable(TABLE.lo, TABLE.step, TABLE.values, TABLE.f_low, "descending", raw)
    lines = draw_curves(down).axes[0].lines
    assert len(lines) == 2 + 2 + 2
    assert [line.get_xdata()[0] for line in lines[2:4]] == [0.5, 0.8]
    assert [line.get_xdata()[-1] for line in lines[2:4]] == [-1.0, -1.0]
    up = FodTable(TABLE.lo, TABLE.step, TABLE.values, TABLE.f_low, "ascending", raw)
    lines = draw_curves(up).axes[0].lines
    assert [line.get_xdata()[0] for line in lines[2:4]] == [-1.0, -1.0]
    assert [line.get_xdata()[-1] for line in lines[2:4]] == pytest.approx([1.0, 1.0])
