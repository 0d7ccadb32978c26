"""Tuning of control laws: by the thesis' route, or by search on the batch engine.

from macromicro import tuning

found = tuning.macro(objective="settling", evaluations=300)
print(found.tuned.controller.pd_tuned, found.bench_costs, found.margins)
"""

from macromicro.tuning.tune import Request, Tuning, macro, micro, tune

__all__ = ["Request", "Tuning", "macro", "micro", "tune"]
