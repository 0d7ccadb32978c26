# %% [markdown]
# # Tune and verify
#
# The thesis' tuned PD moves the carriage by 200 mm in some 0.7 s. A search finds gains that are quicker on
# one step of the bench. Then comes what matters: do they hold on moves that the search has not seen, and on
# a machine that differs?

# %%
import macromicro

found = macromicro.tune(stage="macro", objective="settling", evaluations=60)
before, after = found.costs
print(f"cost on the bench: {before:.3f} s before, {after:.3f} s after")
print("gains:", found.settings.controller.pd_tuned)

# %% [markdown]
# ## Margins
#
# Quicker gains are paid for with margins of the loop. They are computed on the linear model.

# %%
for name, margin in zip(("before", "after"), found.margins(), strict=True):
    print(f"{name}: phase {margin['phase']:.0f} deg, delay {1e3 * margin['delay']:.0f} ms")

# %% [markdown]
# ## Moves that the search has not seen
#
# The programme `fast` has long and short moves of the carriage.

# %%
runs = [macromicro.run("fast", seed=2), macromicro.run("fast", seed=2, settings=found.settings)]
for old, new in zip(*(macromicro.moves(run) for run in runs), strict=True):
    if old.stage == "macro":
        print(f"to {old.target:5g} mm: {old.settling_s:.3f} s before, {new.settling_s:.3f} s after")
macromicro.overlay(*runs, labels=["before", "after"])

# %% [markdown]
# ## A machine that differs
#
# Friction is the least certain of the bench's parameters. With a tenth more and a tenth less of it:

# %%
for friction in ("9.4 N", "10.5 N", "11.5 N"):
    settings = found.settings.with_("bench.friction.coulomb", friction)
    moves = macromicro.moves(macromicro.run("fast", seed=3, settings=settings))
    times = [move.settling_s for move in moves if move.stage == "macro"]
    print(friction, " ".join("-" if t is None else f"{t:.3f}" for t in times), "s")

# %% [markdown]
# `macromicro robust` asks this of hundreds of machines, and `macromicro tune --robust` searches with them in view.
