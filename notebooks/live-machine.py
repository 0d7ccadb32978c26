# %% [markdown]
# # A live machine with live traces
#
# A server runs the loop of the virtual bench at 1000 Hz. This notebook starts one of its own on a free port; yours is
# `macromicro serve` on the lab's computer, and `connect` takes its name.

# %%
import os
import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
from IPython.display import clear_output, display

import macromicro
from macromicro.remote.failures import RequestRefused

folder = Path(tempfile.mkdtemp())
(folder / "live.toml").write_text("[serve]\nmiss_share = 1.0  # this computer may be busy\n")
words = "macromicro serve --config live.toml --web 0 --scpi 0"
server = subprocess.Popen(
    [sys.executable, "-m", *words.split()],
    cwd=folder,
    env={**os.environ, "XDG_STATE_HOME": str(folder)},
    stdout=subprocess.PIPE,
    stderr=subprocess.DEVNULL,
    text=True,
)
port = next(
    int(found[1]) for line in server.stdout if (found := re.search(r"^page: .*:(\d+)/", line))
)

# %% [markdown]
# ## Connect, home, move

# %%
stage = macromicro.connect("127.0.0.1", port=port)
stage.enable()
stage.home()
end = stage.move_to("42.123 mm").wait()
print(end["outcome"], f"at {1e3 * stage.position:.2f} mm")

# %% [markdown]
# ## Live traces
#
# A move that does not wait, and the last two seconds drawn again and again while it goes on.

# %%
figure, axes = plt.subplots(figsize=(8, 3))
motion = stage.move_to("60 mm", wait=False)
for shown in stage.traces(2.0):
    k = shown.names.index("position")
    axes.clear()
    axes.fill_between(shown.time, shown.low[k], shown.high[k])
    axes.set(xlabel="time [s]", ylabel="position [mm]")
    clear_output(wait=True)
    display(figure)
    if stage.state.motion != motion.number:
        break
plt.close(figure)

# %% [markdown]
# ## What goes wrong is an exception
#
# A target beyond the limits is refused, and nothing moves.

# %%
try:
    stage.move_to("300 mm")
except RequestRefused as refusal:
    print(refusal.reason)
    print(refusal.remedy)

# %% [markdown]
# ## End
#
# `close` stops what this client still moves and gives control back.

# %%
stage.close()
server.send_signal(signal.SIGINT)
_ = server.wait(30.0)
