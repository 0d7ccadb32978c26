"""What a loop process imports and compiles, for the process that is forked for each of them."""

from __future__ import annotations

import importlib

from macromicro.rig.opening import TWIN
from macromicro.serve import loop_process
from macromicro.serve.loop_spec import LIVE, Spec
from macromicro.serve.settings import LiveSettings

for family in ("stage.opening", "joint._opening"):
    importlib.import_module(f"macromicro.serve.{family}")
loop_process.open_machine(Spec(TWIN, 0, LiveSettings(), "warm", LIVE, 0)).warm()
