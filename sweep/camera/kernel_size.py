"""How large the kernels of a scene are, before they are made."""

from __future__ import annotations

import numpy as np

from .effects import phase, sampling
from .field import over_field
from .methods import REFERENCE
from .view import View

MOST_KERNEL_BYTES = 2 * 2**30
"""What the images of a scene may take of a worker's memory."""
_COPIES = 4
"""So many arrays of the size of a kernel are held while it is made."""


def pixels_per_place(view: View) -> int:
    """About how many pixels are looked at around each place of a light."""
    target, rows_columns = view.scenario.target, view.mosaic.indices.shape
    if target is None:
        return int(np.prod(rows_columns))
    reach = sampling.reach_px(view, target)
    return int(np.prod([2 * reach + n + 3 for n in rows_columns]))


def bytes_per_place(view: View, *, by_pixel: bool) -> int:
    """About how much memory the kernel of one place of a light takes while it is made.

    Pixels at one place of a sensor are held in factors: see `split_light`.
    """
    n, places = len(view.mosaic.channels), len(over_field(view))
    units = pixels_per_place(view) if by_pixel else n
    each = view.grid.size + n if by_pixel and places == 1 else n * view.grid.size
    return 8 * _COPIES * units * each * places


def blocks(view: View, cases: phase.Cases) -> list[phase.Cases]:
    """Places whose kernels, pixel by pixel, fit into half of `MOST_KERNEL_BYTES` together."""
    step = max(1, MOST_KERNEL_BYTES // 2 // bytes_per_place(view, by_pixel=True))
    return [cases.some(slice(at, at + step)) for at in range(0, len(cases.places_px), step)]


def too_large(view: View) -> tuple[str, str, str] | None:
    """Why a target's kernel is not computed: problem, value, what is allowed; None when it is."""
    if view.scenario.target is None:
        return None
    channels = f"{len(view.mosaic.channels)} channels and {view.grid.size} wavelengths"
    if (one := bytes_per_place(view, by_pixel=True)) > MOST_KERNEL_BYTES:
        problem = f"{pixels_per_place(view):,} pixels around the light, of {channels}, take too much memory"
        return problem, f"{one / 2**30:.1f} GiB", f"at most {MOST_KERNEL_BYTES / 2**30:g} GiB"
    places = len(phase.places_px(view, REFERENCE.phase))
    if places > phase.MOST:
        problem = f"a light at any place of a tile of {view.mosaic.indices.size:,} pixels has too many places"
        return problem, f"{places:,}", f"at most {phase.MOST:,} (a tile of {phase.MOST // 16} pixels), or a named place"
    if (every := places * bytes_per_place(view, by_pixel=False)) > MOST_KERNEL_BYTES:
        problem = f"{places:,} places of the light, of {channels}, take too much memory"
        return problem, f"{every / 2**30:.1f} GiB", f"at most {MOST_KERNEL_BYTES / 2**30:g} GiB"
    return None
