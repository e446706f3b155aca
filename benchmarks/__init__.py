"""Ratios measured side by side in one run: ``python -m benchmarks`` (or ``make bench``)."""

import os

os.environ["OPENBLAS_NUM_THREADS"] = os.environ.get("OPENBLAS_NUM_THREADS", "1")
# Before numpy is loaded: the matrices of a fit are small, and BLAS threads that wait for each other cost several fits.
