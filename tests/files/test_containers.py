"""MAT, HDF5, npz and Parquet files, as MATLAB, Simulink and Python write them."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from macromicro.errors import InputError
from macromicro.files.reading import read
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
    found = pick(read(path), ROLES, wanted)
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
    table = read(tmp_path / "a.mat")
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
    assert read(path).constants == {"gain": 35.0}
    holds(path, u="out.signals.values1:V", x="out.signals.values2:m")


def test_plain_hdf5(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("run 1")
        group["t"], group["drive"] = T, U.astype(np.float32)
        group["place"] = 1e3 * X[:, None]
        group["drive"].attrs["units"], group["place"].attrs["unit"] = "V", b"mm"
        file["names"] = ["a", "b"]
    found = pick(read(tmp_path / "a.h5"), ROLES, {})
    np.testing.assert_allclose(found.values["u"], U, rtol=1e-7)
    np.testing.assert_allclose(found.values["x"], X, rtol=1e-12)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["names"] = ["a", "b"]
    with pytest.raises(InputError, match="no dataset is a vector"):
        read(tmp_path / "b.h5")


def test_tables_in_hdf5(tmp_path: Path) -> None:
    rows = np.zeros(N, dtype=[("t", "f8"), ("u_V", "f4"), ("x_m", "f8"), ("word", "S3")])
    rows["t"], rows["u_V"], rows["x_m"] = T, U, X
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["log"] = rows
    found = pick(read(tmp_path / "a.h5"), ROLES, {})
    np.testing.assert_allclose(found.values["x"], X, rtol=1e-15)


def test_archives_of_numpy(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", t=T, u_V=U, x_m=X, gain=35.0, words=np.array(["a"]))
    holds(tmp_path / "a.npz")
    assert read(tmp_path / "a.npz").constants == {"gain": 35.0}
    np.savez(tmp_path / "b.npz", t=np.array([{}], dtype=object))
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "b.npz")


def test_parquet(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    place = pa.field("place", pa.float64(), metadata={"unit": "mm"})
    schema = pa.schema([pa.field("time", pa.timestamp("us")), pa.field("u_V", pa.float64())])
    schema = schema.append(place).append(pa.field("note", pa.string()))
    stamps = np.datetime64("2024-03-01T12:00:00", "us") + np.round(1e6 * T).astype("m8[us]")
    made = pa.table([stamps, U, 1e3 * X, ["a"] * N], schema=schema)
    pq.write_table(made, tmp_path / "a.parquet")
    found = pick(read(tmp_path / "a.parquet"), ROLES, {})
    np.testing.assert_allclose(found.values["t"], T, rtol=1e-12)
    np.testing.assert_allclose(found.values["x"], X, rtol=1e-12)
    assert "note" not in read(tmp_path / "a.parquet").columns
    (tmp_path / "b.parquet").write_bytes(b"PAR1 and nothing else")
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "b.parquet")
