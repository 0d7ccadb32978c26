# %% [markdown]
# # Identify your motor
#
# You have recorded time, voltage and position of a motor-driven axis. Mass and friction follow from that, with
# standard errors, and a simulation that can be compared with data it was not fitted to.
#
# ## A record
#
# This stands for your file: an axis of known mass and friction, driven by pulses, its
# position with 20 um of noise, in steps of 5 um.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from macromicro import identify

true = identify.Axis(mass=1.2, viscous=14.0, coulomb=3.0, offset=0.4)  # kg, N s/m, N, N
gain, dt = 4.0, 2e-3  # N/V, s
random = np.random.default_rng(1)
volts = np.concatenate(
    [np.full(random.integers(50, 150), random.uniform(-5, 5)) for _ in range(30)]
)
noise = 20e-6 * random.standard_normal(len(volts))  # m, of the sensor
place = np.round((identify.simulate(true, gain * volts, dt) + noise) / 5e-6) * 5e-6
rows = np.column_stack([dt * np.arange(len(volts)), volts, 1e3 * place])
file = Path(tempfile.mkdtemp()) / "own.csv"
np.savetxt(file, rows, delimiter=",", header="t_s,u_V,x_mm", comments="", fmt="%.6f")

figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(8, 4))
above.plot(rows[:, 0], rows[:, 1])
above.set_ylabel("voltage [V]")
below.plot(rows[:, 0], rows[:, 2])
below.set(xlabel="time [s]", ylabel="position [mm]")
plt.show()
# %% [markdown]
# ## Mass and friction
#
# Names and units stand in the heading, so nothing else has to be said. `+-` is one standard error.

# %%
found = identify.from_files("drive", file, gain=gain, structure="coulomb")
print(found)

# %%
for name, error in found.uncertainty.items():
    value, truth = getattr(found.model, name), getattr(true, name)
    print(
        f"{name:8} {value:7.3f}, made with {truth:5.2f}: {(value - truth) / error:+.1f} errors off"
    )

# %% [markdown]
# ## The free run
#
# The model runs from the record's start by the voltage alone. What it misses is what the errors are made of.

# %%
free = identify.simulate(found.model, gain * volts, dt)
plt.figure(figsize=(8, 2.6))
plt.plot(rows[:, 0], 1e6 * (place - free))
plt.xlabel("time [s]")
plt.ylabel("measured - free run [um]")
plt.show()

# %% [markdown]
# `found.save("folder")` writes figures and `model.toml`, a machine that `macromicro run --config` takes, with gains
# that follow from it.
