"""Your own CSV file: a drive with friction, identified by the command line.

python examples/own_csv.py FOLDER

Makes FOLDER/own.csv, which stands for what your rig recorded (time in ms, drive voltage,
position in mm, columns named as a rig names them), runs `macromicro identify drive` on it,
and draws the free run of what came back.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from macromicro.identify import Axis, simulate
from macromicro.identify.result import rounded

TRUE = Axis(mass=1.2, viscous=14.0, coulomb=3.0, offset=0.4)  # kg, N s/m, N, N
GAIN = 4.0  # N/V
DT = 2e-3


def write(file: Path) -> None:
    """What the rig recorded: pulses of both signs, the position in steps of 5 um."""
    random = np.random.default_rng(1)
    pulses = [np.full(random.integers(50, 150), random.uniform(-5.0, 5.0)) for _ in range(30)]
    volts = np.round(np.concatenate(pulses), 3)
    metres = simulate(TRUE, GAIN * volts, DT)
    rows = ["clock_ms,amplifier_V,scale_mm"]
    for k, (u, x) in enumerate(zip(volts, metres, strict=True)):
        rows.append(f"{k * DT * 1e3:g},{u:g},{round(x / 5e-6) * 5e-3:.3f}")
    file.write_text("\n".join(rows) + "\n", encoding="utf-8")


def main(folder: Path) -> None:
    """Write, identify, compare, draw."""
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "own.csv"
    write(file)
    columns = "t=clock,u=amplifier,x=scale"
    words = ["identify", "drive", str(file), "--columns", columns, "--gain", f"{GAIN:g}"]
    print("macromicro", *words)
    command = [sys.executable, "-m", "macromicro", *words, "--json"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    found = {line["name"]: line for line in json.loads(done.stdout)["values"]}
    for name, line in found.items():
        value, error = rounded(line["value"], line["error"])
        print(f"{name:9}{value:>10} +- {error} {line['unit']:6} (made with {getattr(TRUE, name)})")

    from matplotlib.figure import Figure

    clock, volts, scale = np.loadtxt(file, delimiter=",", skiprows=1, unpack=True)
    axis = Axis(**{name: line["value"] for name, line in found.items()})
    model = simulate(axis, GAIN * volts, DT, 1e-3 * scale[0])
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    top, low = figure.subplots(2, sharex=True)
    top.plot(1e-3 * clock, scale, label="measured")
    top.plot(1e-3 * clock, 1e3 * model, "--", label="model, free run")
    top.set_ylabel("position [mm]")
    top.legend()
    low.plot(1e-3 * clock, scale - 1e3 * model, "C3")
    low.set(xlabel="time [s]", ylabel="measured less model [mm]")
    figure.savefig(folder / "own_csv.png")
    print(f"figure: {folder / 'own_csv.png'}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
