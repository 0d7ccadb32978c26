from __future__ import annotations

import os

# Of OpenMP, OpenBLAS and MKL; read when numpy is imported.
BLAS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_for_blas() -> None:
    """Limit BLAS to one thread, for speed and exact digits; call before importing numpy."""
    for name in BLAS:
        os.environ.setdefault(name, "1")
