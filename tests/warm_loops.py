"""What a loop process imports and compiles, for the process that is forked for each of them."""

from __future__ import annotations

from macromicro import threads

threads.one_for_blas()  # before numpy is imported

import macromicro.serve.joint._opening
import macromicro.serve.stage.opening
from macromicro.rig.opening import TWIN
from macromicro.serve import loop_process
from macromicro.serve.loop_spec import LIVE, Spec
from macromicro.serve.settings import LiveSettings

loop_process.open_machine(Spec(TWIN, 0, LiveSettings(), "warm", LIVE, 0)).warm()
