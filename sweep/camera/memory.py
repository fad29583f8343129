"""Memory of the pixel responses of a scene, before they are made."""

from __future__ import annotations

import numpy as np

from .field import field_heights
from .phases import MOST_PHASES, Phases, n_phases
from .sampling import reach_px
from .setup import Setup

MOST_BYTES = 2 * 2**30
"""Most memory of a worker for the images of a scene, bytes."""
_COPIES = 4
"""So many arrays of the size of a response are held while it is made."""


def pixels_per_phase(setup: Setup) -> int:
    """About how many pixels are computed around a light."""
    target, rows_columns = setup.scene.target, setup.camera.mosaic.indices.shape
    assert target is not None
    reach = reach_px(setup, target)
    return int(np.prod([2 * reach + n + 3 for n in rows_columns]))


def bytes_per_phase(setup: Setup, *, by_pixel: bool) -> int:
    """About how much memory the response at one phase takes while it is made.

    Pixels are held in factors (see `SplitLight`), those of one field position after the other.
    """
    n = len(setup.camera.mosaic.channels)
    if by_pixel:
        return 8 * _COPIES * pixels_per_phase(setup) * (setup.camera.grid.size + n)
    return 8 * _COPIES * n * n * setup.camera.grid.size * len(field_heights(setup))


def blocks(setup: Setup, phases: Phases) -> list[Phases]:
    """Phases whose responses, pixel by pixel, fit into half of `MOST_BYTES` together."""
    step = max(1, MOST_BYTES // 2 // bytes_per_phase(setup, by_pixel=True))
    return [phases.subset(slice(at, at + step)) for at in range(0, len(phases), step)]


def too_large(setup: Setup) -> tuple[str, str, str] | None:
    """Why a target's response is not computed: problem, value, what is allowed; None when it is."""
    if setup.scene.target is None:
        return None
    channels = f"{len(setup.camera.mosaic.channels)} channels and {setup.camera.grid.size} wavelengths"
    if (one := bytes_per_phase(setup, by_pixel=True)) > MOST_BYTES:
        problem = f"{pixels_per_phase(setup):,} pixels around the light, of {channels}, take too much memory"
        return problem, f"{one / 2**30:.1f} GiB", f"at most {MOST_BYTES / 2**30:g} GiB"
    places = n_phases(setup)
    if places > MOST_PHASES:
        problem = f"a light at any place of a tile of {setup.camera.mosaic.indices.size:,} pixels has too many places"
        allowed = f"at most {MOST_PHASES:,} (a tile of {MOST_PHASES // 16} pixels), or a named place"
        return problem, f"{places:,}", allowed
    if (total := places * bytes_per_phase(setup, by_pixel=False)) > MOST_BYTES:
        problem = f"{places:,} places of the light, of {channels}, take too much memory"
        return problem, f"{total / 2**30:.1f} GiB", f"at most {MOST_BYTES / 2**30:g} GiB"
    return None
