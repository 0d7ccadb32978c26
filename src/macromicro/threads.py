"""How many threads linear algebra may take."""

from __future__ import annotations

import os

# Of OpenMP, OpenBLAS and MKL; read when numpy is imported.
BLAS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_for_blas() -> None:
    """One thread for linear algebra from here on, unless the user's environment says otherwise.

    Fits solve thousands of systems of ten columns. Threads cost such a system more than they
    bring, several times as much where other programs run, and change its last digits with the
    number of cores. To be called before numpy is imported.
    """
    for name in BLAS:
        os.environ.setdefault(name, "1")
