"""A measured drive, end to end: EMPS (A. Janot, M. Gautier, M. Brunot, 2019).

python examples/emps.py FOLDER [DATA_EMPS.mat]

A DC motor and ball screw at 1 kHz for 25 s. Without a file, the reduced copy in
data/emps is used. Prints parameters beside the published ones and draws the free run.
"""

import sys
from pathlib import Path

import numpy as np

from macromicro.files.reading import read_table
from macromicro.identify import drive

COPY = Path(__file__).parent / "data/emps/emps.npz"
PUBLISHED = {"mass": 95.1089, "viscous": 203.5034, "coulomb": 20.3935, "offset": -3.1648}
UNITS = {"mass": "kg", "viscous": "N s/m", "coulomb": "N", "offset": "N"}


def load(file: Path | None) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """t [s], drive voltage [V], position [m] and the drive's gain [N/V]."""
    if file is not None:
        table = read_table(file)
        t, u, x = (table.columns[name] for name in ("t", "vir", "qm"))
        return t, u, x, table.constants["gtau"]
    if not COPY.is_file():
        sys.exit(f"no copy of the data at {COPY}; name the file: emps.py FOLDER DATA_EMPS.mat")
    with np.load(COPY, allow_pickle=False) as copy:
        x = 50e-9 * np.cumsum(copy["position"].astype(np.int64))
        return np.arange(len(x)) * 1e-3, 2e-4 * copy["volts"], x, float(copy["gain"])


def main(folder: Path, file: Path | None) -> None:
    """Identify, compare, draw."""
    t, u, x, gain = load(file)
    fit = drive(t, u, x, gain=gain, structure="coulomb")
    for estimate, name in ((fit.inverse, "inverse dynamics"), (fit.refined, "output error")):
        print(name)
        for parameter, value, error in zip(
            estimate.names, estimate.values, estimate.std, strict=True
        ):
            print(
                f"  {parameter:9}{value:9.3f} +- {error:6.3f} {UNITS[parameter]:6}"
                f" (published {PUBLISHED[parameter]:.3f})"
            )
    print(f"free run: {fit.rms * 1e3:.2f} mm RMS, {fit.fit:.2f} %")
    best = drive(t, u, x, gain=gain)
    print(f"chosen on held-out data: {best.structure}, {best.rms * 1e3:.2f} mm RMS")

    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    top, low = figure.subplots(2, sharex=True)
    top.plot(t, x, label="measured")
    top.plot(t, fit.free_run[0], "--", label="four parameters")
    top.plot(t, best.free_run[0], ":", label=best.structure)
    top.set_ylabel("position [m]")
    top.legend()
    low.plot(t, (x - fit.free_run[0]) * 1e3, "C1--", t, (x - best.free_run[0]) * 1e3, "C2:")
    low.set(xlabel="time [s]", ylabel="measured less model [mm]")
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "emps.png")
    print(f"figure: {folder / 'emps.png'}")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) == 3 else None)
