# %% [markdown]
# # Hysteresis from first-order curves
#
# Measured first-order reversal curves of FeCo nanowires, a MicroMag file from the repository's tests, become a
# Preisach table. The table predicts curves that it has not seen, and its inverse leads the output along a sine.

# %%
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from macromicro.hysteresis import FodTable, Preisach
from macromicro.hysteresis.forc import read_forc
from macromicro.hysteresis.pictures import draw_plane

folder = next(p for p in (Path.cwd(), *Path.cwd().parents) if (p / "examples" / "data").is_dir())
curves = read_forc(folder / "examples" / "data" / "forc" / "hchb_forc").curves
print(len(curves), "curves,", sum(len(u) for u, _ in curves), "points")

# %%
plt.figure(figsize=(8, 3.6))
for u, f in curves[::8]:
    plt.plot(u, 1e3 * f, linewidth=0.8)
plt.xlabel("field [Oe]")
plt.ylabel("moment [memu]")
plt.show()
# %% [markdown]
# ## Does the model fit?
#
# A table from every second, fourth and eighth curve predicts the others. A model that only repeats what it has seen
# would fail here.

# %%
fields = np.concatenate([u for u, _ in curves])
moments = np.concatenate([f for _, f in curves])
ends = (float(fields.min()), float(fields.max()))
for every in (2, 4, 8):
    table = FodTable.from_curves(curves[::every], "ascending", limits=ends)
    unseen = [curve for k, curve in enumerate(curves) if k % every]
    error = table.misfit(unseen).rms / np.ptp(moments)
    print(f"1 of {every} curves: the others within {100 * error:.3f} % of range, RMS")

# %% [markdown]
# ## The density of relays
#
# Where the density is high, many relays switch. The narrow ridge is the wires' own coercivity, its width their
# interaction.

# %%
table = FodTable.from_curves(curves, "ascending", shape="monotone", limits=ends)
density = np.sign(table.span) * table.density
most = float(np.nanquantile(np.abs(density), 0.995))
plt.figure(figsize=(5, 4))
plt.pcolormesh(table.grid, table.grid, density, cmap="RdBu", vmin=-most, vmax=most, rasterized=True)
plt.xlabel("down threshold [Oe]")
plt.ylabel("up threshold [Oe]")
plt.show()
# %% [markdown]
# ## Forward and back
#
# `run` moves the input and remembers the turning points. `run_inverse` finds the inputs that lead the output along a
# wanted path: here two periods of a sine.

# %%
wires = Preisach(table)
wanted = table.f_low + table.span * (0.5 + 0.4 * np.sin(np.linspace(0.0, 4.0 * np.pi, 400)))
inputs, reached = wires.run_inverse(wanted)
print(f"off by {np.abs(reached - wanted).max() / abs(table.span):.0e} of full scale at most")
plt.figure(figsize=(8, 3))
plt.plot(inputs)
plt.xlabel("step")
plt.ylabel("field that is needed [Oe]")
plt.show()
# %% [markdown]
# What the model remembers is a staircase in the plane of thresholds: one step for each turning point that still
# matters.

# %%
draw_plane(wires, "Oe")
