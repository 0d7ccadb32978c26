"""MAT, HDF5, npz and Parquet files, as MATLAB, Simulink and Python write them."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.files._containers import OwnTimesWarning
from macromicro.files.reading import read_table
from macromicro.identify.picking import Role, pick

N = 12
T = 0.1 * np.arange(N)
U, X = np.sin(T), np.cos(T)
ROLES = (
    Role("t", "time", ("t", "time"), ("s",)),
    Role("u", "drive", ("u", "drive"), ("V",)),
    Role("x", "place", ("x", "place"), ("m",)),
)


def holds(path: Path, **wanted: str) -> None:
    """The roles are found, with the numbers above."""
    found = pick(read_table(path), ROLES, wanted)
    for role, values in (("t", T), ("u", U), ("x", X)):
        np.testing.assert_allclose(found.values[role], values, rtol=1e-15)


def simulink() -> dict[str, object]:
    """A "structure with time" of two signals."""
    signals = np.empty((1, 2), dtype=[("values", object), ("label", object)])
    signals[0, 0] = (U[:, None], "drive_V")
    signals[0, 1] = (X[:, None], "place_m")
    return {"out": {"time": T[:, None], "signals": signals, "blockName": "model/scope"}}


def test_simulink_structs(tmp_path: Path) -> None:
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", simulink())
    holds(tmp_path / "a.mat")


def test_structs_and_matrices(tmp_path: Path) -> None:
    from scipy.io import savemat

    content = {"rig": {"time": T, "log_V": np.c_[U, X], "gain": 35.0}, "comment": "warm"}
    savemat(tmp_path / "a.mat", content)
    table = read_table(tmp_path / "a.mat")
    assert set(table.columns) == {"rig.time", "rig.log_V1", "rig.log_V2"}
    assert table.constants == {"rig.gain": 35.0}
    holds(tmp_path / "a.mat", u="log_V1:V", x="rig.log_V2:m")


@pytest.mark.parametrize("many", [False, True])
def test_mat_of_version_7_3(tmp_path: Path, many: bool) -> None:
    """As MATLAB writes it: HDF5 behind a block of text, matrices lying, structs as groups."""
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        out = file.create_group("out")
        out.attrs["MATLAB_class"] = np.bytes_("struct")
        out["time"] = T[None, :]
        out["time"].attrs["MATLAB_class"] = np.bytes_("double")
        signals = out.create_group("signals")
        if many:
            refs = file.create_group("#refs#")
            kept: dict[str, list[h5py.Reference]] = {"values": [], "label": []}
            for name, values in (("drive_V", U), ("place_m", X)):
                refs[f"v{name}"] = values[None, :]
                refs[f"l{name}"] = np.array([[ord(c)] for c in name], dtype=np.uint16)
                kept["values"].append(refs[f"v{name}"].ref)
                kept["label"].append(refs[f"l{name}"].ref)
            for key, items in kept.items():
                made = signals.create_dataset(key, (2, 1), dtype=h5py.ref_dtype)
                made[:, 0] = items
        else:
            signals["values"] = np.array([U, X])
            file["gain"] = np.array([[35.0]])
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    if many:
        holds(path)
        return
    assert read_table(path).constants == {"gain": 35.0}
    holds(path, u="out.signals.values1:V", x="out.signals.values2:m")


def test_plain_hdf5(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("run 1")
        group["t"], group["drive"] = T, U.astype(np.float32)
        group["place"] = 1e3 * X[:, None]
        group["drive"].attrs["units"], group["place"].attrs["unit"] = "V", b"mm"
        file["names"] = ["a", "b"]
    found = pick(read_table(tmp_path / "a.h5"), ROLES, {})
    np.testing.assert_allclose(found.values["u"], U, rtol=1e-7)
    np.testing.assert_allclose(found.values["x"], X, rtol=1e-12)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["names"] = ["a", "b"]
    with pytest.raises(InputError, match="no dataset is a vector"):
        read_table(tmp_path / "b.h5")


def test_tables_in_hdf5(tmp_path: Path) -> None:
    rows = np.zeros(N, dtype=[("t", "f8"), ("u_V", "f4"), ("x_m", "f8"), ("word", "S3")])
    rows["t"], rows["u_V"], rows["x_m"] = T, U, X
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["log"] = rows
    found = pick(read_table(tmp_path / "a.h5"), ROLES, {})
    np.testing.assert_allclose(found.values["x"], X, rtol=1e-15)


def test_archives_of_numpy(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t=T, u_V=U, x_m=X, gain=35.0, words=np.array(["a"]))
    holds(tmp_path / "a.npz")
    assert read_table(tmp_path / "a.npz").constants == {"gain": 35.0}
    np.savez(tmp_path / "b.npz", t=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path / "b.npz")


def test_parquet(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    place = pa.field("place", pa.float64(), metadata={"unit": "mm"})
    schema = pa.schema([pa.field("time", pa.timestamp("us")), pa.field("u_V", pa.float64())])
    schema = schema.append(place).append(pa.field("note", pa.string()))
    stamps = np.datetime64("2024-03-01T12:00:00", "us") + np.round(1e6 * T).astype("m8[us]")
    made = pa.table([stamps, U, 1e3 * X, ["a"] * N], schema=schema)
    pq.write_table(made, tmp_path / "a.parquet")
    found = pick(read_table(tmp_path / "a.parquet"), ROLES, {})
    np.testing.assert_allclose(found.values["t"], T, rtol=1e-12)
    np.testing.assert_allclose(found.values["x"], X, rtol=1e-12)
    assert "note" not in read_table(tmp_path / "a.parquet").columns
    (tmp_path / "b.parquet").write_bytes(b"PAR1 and nothing else")
    with pytest.raises(InputError, match="cannot be read"):
        read_table(tmp_path / "b.parquet")


def timeseries(name: str, values: np.ndarray, unit: str = "", time: np.ndarray = T) -> Any:
    """A timeseries as struct(ts) gives it; Simulink stacks its values along the last axis."""
    made = {"Time": time[:, None], "Data": values, "Name": name}
    return made | {"DataInfo": {"Units": unit}} if unit else made


def test_timeseries_of_matlab(tmp_path: Path) -> None:
    """By their names, with the units that they say."""
    from scipy.io import savemat

    path = tmp_path / "a.mat"
    content = {"a": timeseries("drive", U[:, None], "V"), "x": timeseries("", X[None, None, :])}
    savemat(path, content)
    table = read_table(path)
    assert set(table.columns) == {"drive.Time", "drive", "x.Time", "x"}
    assert (table.units["drive"], table.units["drive.Time"], table.units["x"]) == ("V", "s", "")
    holds(path, x="x:m")
    savemat(path, {"both": timeseries("log", np.stack([U, X])[None])})  # 1 x 2 x n
    np.testing.assert_array_equal(read_table(path).columns["log2"], X)


def test_a_dataset_of_simulink(tmp_path: Path) -> None:
    from scipy.io import savemat

    elements = np.empty(2, dtype=object)
    elements[0] = {"Name": "drive_V", "Values": timeseries("", U[:, None])}
    elements[1] = {"Name": "place_m", "Values": timeseries("", X[:, None])}
    savemat(tmp_path / "a.mat", {"logsout": {"elements": elements}})
    holds(tmp_path / "a.mat")
    signals = {"drive": timeseries("", U[:, None], "V"), "place": timeseries("", X[:, None], "m")}
    savemat(tmp_path / "b.mat", {"logsout": signals})
    holds(tmp_path / "b.mat")


def test_timeseries_with_times_of_their_own_are_said_to_have_them(tmp_path: Path) -> None:
    from scipy.io import savemat

    content = {"u": timeseries("", U), "x": timeseries("", X, time=T + 0.01)}
    savemat(tmp_path / "a.mat", content)
    with pytest.warns(OwnTimesWarning, match=r"x has times of its own, x\.Time; others have u\.T"):
        read_table(tmp_path / "a.mat")


def test_objects_of_matlab_are_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class MatlabOpaque(np.ndarray):
        pass

    found = {"ts": np.zeros(1, dtype=[("s0", "O")]).view(MatlabOpaque)}
    monkeypatch.setattr("scipy.io.loadmat", lambda *_, **__: dict(found))
    (tmp_path / "a.mat").write_bytes(b"MATLAB 5.0 MAT-file")
    with pytest.raises(InputError, match=r"objects of MATLAB.*save vectors: t = ts\.Time"):
        read_table(tmp_path / "a.mat")


def test_timeseries_in_mat_of_version_7_3(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.mat", "w") as file:
        for name, values in (("drive_V", U), ("place_m", X)):
            group = file.create_group(name)
            group["Time"], group["Data"] = T[None, :], values[None, :]
    holds(tmp_path / "a.mat")


@pytest.mark.parametrize("name", ["a.json", "a.txt"])
def test_json_in_rows_in_lines_and_in_columns(tmp_path: Path, name: str) -> None:
    rows = [{"t": t, "u_V": u, "x_m": x, "note": "warm"} for t, u, x in zip(T, U, X, strict=True)]
    texts = [
        json.dumps(rows, indent=1),
        "\n".join(map(json.dumps, rows)),
        json.dumps({"t": list(T), "u_V": list(U), "x_m": list(X), "gain": 35.0, "rig": "3"}),
        json.dumps({"t": list(T), "u": list(U), "x": list(X), "units": {"u": "V", "x": "m"}}),
        json.dumps({"run": {"rows": rows}}),
        json.dumps([{"t": r["t"], "log": {"u_V": r["u_V"], "x_m": r["x_m"]}} for r in rows]),
    ]
    for text in texts:
        (tmp_path / name).write_text(text)
        holds(tmp_path / name)
        assert not {"note", "rig"} & set(read_table(tmp_path / name).columns)
    (tmp_path / name).write_text(texts[2])
    assert read_table(tmp_path / name).constants == {"gain": 35.0}


def test_json_with_dates_and_without_some_values(tmp_path: Path) -> None:
    rows = [{"when": f"2024-03-01T12:00:0{k}", "u_V": None if k == 1 else k} for k in range(4)]
    (tmp_path / "a.json").write_text(json.dumps(rows))
    table = read_table(tmp_path / "a.json")
    assert table.units == {"when": "s", "u_V": "V"}
    assert np.diff(table.columns["when"]).tolist() == [1.0, 1.0, 1.0]
    np.testing.assert_array_equal(table.columns["u_V"], [0.0, np.nan, 2.0, 3.0])


@pytest.mark.parametrize(("text", "found"), [('{"t": [0, 1', "cannot be read"), ("{}", "no vari")])
def test_json_without_columns_is_refused(tmp_path: Path, text: str, found: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError, match=found):
        read_table(tmp_path / "a.json")


def test_tdms_needs_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "nptdms", None)
    (tmp_path / "a.tdms").write_bytes(b"TDSm")
    with pytest.raises(InputError, match=r"nptdms is not installed.*'macromicro\[tdms\]'"):
        read_table(tmp_path / "a.tdms")


def test_tdms(tmp_path: Path) -> None:
    """Waveforms have an increment, plain channels a column of times."""
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "a.tdms"

    def channel(name: str, values: np.ndarray, **said: Any) -> Any:
        return nptdms.ChannelObject("rig", name, values, properties=said)

    waveform = {"wf_increment": 0.1, "wf_start_offset": 0.0}
    drive = channel("drive", U, unit_string="Volts", **waveform)
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([drive, channel("place_m", X, **waveform)])
    assert set(read_table(path).columns) == {"rig.time", "rig.drive", "rig.place_m"}
    np.testing.assert_allclose(read_table(path).columns["rig.time"], T, rtol=1e-12)
    assert read_table(path).units["rig.drive"] == "V"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([channel("time", T), channel("drive_V", U), channel("place_m", X)])
    holds(path)
    path.write_bytes(path.read_bytes()[:50])
    with pytest.raises(InputError):
        read_table(path)
