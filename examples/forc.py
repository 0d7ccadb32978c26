"""Measured hysteresis, end to end: first-order reversal curves of FeCo nanowires.

python examples/forc.py FOLDER [FILE]

A table from every second, fourth and eighth curve predicts the curves that it did not
see; then the model is led along an output, by its inverse. Draws curves and density.
"""

import sys
from pathlib import Path

import numpy as np

from macromicro.hysteresis import FodTable, Preisach
from macromicro.hysteresis.forc import read_forc

COPY = Path(__file__).parent / "data/forc/hchb_forc"


def main(folder: Path, file: Path) -> None:
    """Read, fit, predict, invert, draw."""
    if not file.is_file():
        sys.exit(f"no data at {file}; name a MicroMag file: forc.py FOLDER FILE")
    curves = read_forc(file).curves
    moments = np.concatenate([f for _, f in curves])
    fields = np.concatenate([u for u, _ in curves])
    ends = (float(fields.min()), float(fields.max()))
    print(f"{len(curves)} curves, {len(moments)} points")
    for every, word in ((2, "second"), (4, "fourth"), (8, "eighth")):
        table = FodTable.from_curves(curves[::every], "ascending", limits=ends)
        unseen = [c for k, c in enumerate(curves) if k % every]
        error = table.misfit(unseen).rms / float(np.ptp(moments))
        print(f"from every {word} curve, the others within {100 * error:.3f} % of range RMS")

    table = FodTable.from_curves(curves, "ascending", shape="monotone", limits=ends)
    model = Preisach(table)
    middle, half = table.f_low + 0.5 * table.span, 0.4 * abs(table.span)
    wanted = middle + half * np.sin(np.linspace(0.0, 4.0 * np.pi, 400))
    fields, reached = model.run_inverse(wanted)
    worst = float(np.abs(reached - wanted).max()) / abs(table.span)
    print(f"inverse along a sine: {worst:.1e} of full scale at worst, H to {fields.max():.0f} Oe")

    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for u, f in curves[::8]:
        left.plot(u, f, ".", color="0.6", markersize=2)
        left.plot(u, table.curve(float(u[0]), u), "C0", linewidth=0.8)
    left.set(xlabel="field [Oe]", ylabel="moment [emu]", title="every eighth curve, and the table")
    density = np.sign(table.span) * table.density
    most = float(np.nanquantile(np.abs(density), 0.995))
    right.pcolormesh(table.grid, table.grid, density, cmap="RdBu", vmin=-most, vmax=most)
    right.set(xlabel="down threshold [Oe]", ylabel="up threshold [Oe]", title="relay density")
    folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(folder / "forc.png")
    print(f"figure: {folder / 'forc.png'}")


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) == 3 else COPY)
