# %% [markdown]
# # First run
#
# A programme on the virtual positioner, its moves, its figures, and the same programme with more friction.

# %%
import macromicro

run = macromicro.run("fast", seed=1)
run

# %% [markdown]
# Each move of the programme, with the time until it stayed in its band: a count of the encoder for the carriage,
# 10 um by the laser for the micro-stage.

# %%
for move in macromicro.moves(run):
    if move.complete:
        print(f"{move.stage:5} to {move.target:6g} {move.unit}: {move.settling_s:.3f} s")

# %% [markdown]
# A recording is a set of columns, each with its unit. `run["laser"]` is an array; `run.plot` draws.

# %%
print(run["t"][-1], "s;", run["laser"].max(), "um at most by the laser")
run.plot("macro_position", "motor")

# %% [markdown]
# Settings are a tree. `with_` gives a copy with changes, by path and with units, checked as a file is.

# %%
sticky = macromicro.Settings().with_("bench.friction.coulomb", "11 N")
other = macromicro.run("fast", seed=1, settings=sticky)
macromicro.overlay(run, other, labels=["nominal", "sticky"])

# %% [markdown]
# What cannot be is refused, with the reason and what would be accepted.

# %%
try:
    macromicro.Settings().with_("bench.friction.coulomb", "12 V")
except macromicro.InputError as error:
    print(error)
