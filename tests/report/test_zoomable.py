"""A page to zoom in: it holds the recording, runs no one's text, and asks no network."""

from __future__ import annotations

import numpy as np
import pytest
from tests.report.plotted import COLUMNS, content, made, unpacked

from macromicro.errors import InputError
from macromicro.recording import Recording
from macromicro.report import zoomable


def test_the_page_holds_every_row() -> None:
    """In single precision of the range: 4 mm to 1 nm."""
    run = made()
    told = content(zoomable.page([run], ["place", "stage_reference", "phase"]))
    assert told["panels"] == [
        {"unit": "mm", "columns": ["place", "stage_reference"]},
        {"unit": "", "columns": ["phase"]},
    ]
    assert told["references"] == ["stage_reference"]
    (side,) = told["sides"]
    np.testing.assert_array_equal(unpacked(side["t"], "<f8"), run["t"])
    for name in ("place", "stage_reference", "phase"):
        column = side["columns"][name]
        assert "high" not in column
        shown = column["middle"] + unpacked(column["low"])
        np.testing.assert_allclose(shown, run[name], rtol=0, atol=1e-6)


def test_a_long_recording_keeps_its_extremes() -> None:
    """4000 rows of two columns in 1000 values: 16 rows a point, by least and greatest."""
    run = made()
    page = zoomable.page([run], ["place", "phase"], most=1000)
    (side,) = content(page)["sides"]
    assert side["every"] == 16 and "stands for 16 rows" in page
    column = side["columns"]["place"]
    low, high = (column["middle"] + unpacked(column[key]) for key in ("low", "high"))
    blocks = run["place"].reshape(-1, 16)
    np.testing.assert_allclose(low, blocks.min(axis=1), atol=1e-6)
    np.testing.assert_allclose(high, blocks.max(axis=1), atol=1e-6)
    np.testing.assert_array_equal(unpacked(side["t"], "<f8"), run["t"][::16])
    assert "stands for" not in zoomable.page([run], ["place"])


def test_what_is_no_number_parts_the_line() -> None:
    nan = np.nan
    run = Recording.from_arrays(
        COLUMNS[:3], [np.arange(4.0), [nan] * 4, [1.0, nan, np.inf, 3.0]], 1.0, {}
    )
    (side,) = content(zoomable.page([run], ["place", "stage_reference"]))["sides"]
    assert side["columns"]["place"]["middle"] == 2.0
    np.testing.assert_array_equal(unpacked(side["columns"]["place"]["low"]), [-1, nan, nan, 1])
    assert np.isnan(unpacked(side["columns"]["stage_reference"]["low"])).all()


def test_recordings_that_begin_apart_count_from_their_first_rows() -> None:
    told = content(zoomable.page([made(), made(start=1000.0)], ["place"], ["old", "new"]))
    assert [side["label"] for side in told["sides"]] == ["old", "new"]
    assert [unpacked(side["t"], "<f8")[0] for side in told["sides"]] == [0.0, 0.0]


def test_text_is_escaped_and_no_address_is_named() -> None:
    page = zoomable.page([made()], labels=["<img src=x>"])
    assert "<img" not in page and "Ramp &amp; &lt;i&gt;" in page
    assert "set point &lt;/script&gt;" in page
    assert page.count("</script>") == 2
    bare = page.replace("data:,", "").replace("/*! https://github.com/leeoniya/uPlot", "")
    assert "http:" not in bare and "https:" not in bare and "url(" not in bare
    assert "default-src 'none'" in page


def test_columns_are_chosen_by_name() -> None:
    with pytest.raises(InputError, match="'plac'; accepted: t, stage_reference, place, phase"):
        zoomable.page([made()], ["plac"])
