"""Points that fill a box evenly."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np

from ..base.types import Array, Float


def sobol_points(dimensions: int, count: int, seed: int) -> Float[Array, "count dimensions"]:
    """Return the first points of a scrambled Sobol sequence."""
    from scipy.stats import qmc  # noqa: PLC0415  (slow to import; only searches need it)

    # In a thread of its own, which takes no signals: SciPy prints a traceback if Ctrl-C reaches it while it reads its
    # direction numbers, and goes on.
    with ThreadPoolExecutor(1) as thread:
        sobol = thread.submit(qmc.Sobol, dimensions, scramble=True, rng=np.random.default_rng(seed)).result()
    return np.asarray(sobol.random_base2(max(1, (count - 1).bit_length()))[:count], dtype=float)
