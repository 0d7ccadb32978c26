"""What the commands import, for the process that is forked for each of them."""

from __future__ import annotations

import importlib
import pkgutil

import macromicro
from macromicro import threads

threads.one_for_blas()  # before numpy is imported

for module in pkgutil.walk_packages(macromicro.__path__, "macromicro.", onerror=lambda name: None):
    if not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ImportError:  # of an extra that is not installed
            continue
