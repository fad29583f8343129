"""What the camera keeps between scenes, forgotten: for measurements of a scene that is the first of its process."""

from __future__ import annotations

from .effects import blur, noise, quantization, sampling
from .encircled import ENCIRCLED
from .kernel import KERNELS
from .noisy import moments, table
from .place_cells import forget_cells
from .seen import MATRICES


def forget_scenes() -> None:
    """Let the next scene compute its kernels, its filters and the table of its noisy pixel anew."""
    for cache in (blur.PROFILES, ENCIRCLED, KERNELS, MATRICES, sampling.MEANS):
        cache.clear()
    for found in (
        blur.interpolation_bound,
        noise.range_of_pixel,
        quantization.under_noise,
        moments.table_without_prnu,
        table.tables,
    ):
        found.cache_clear()
    table.unclipped_e.cache_clear()
    forget_cells()
