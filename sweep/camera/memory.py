"""Estimate of the memory of the pixel responses of a scene."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..base.errors import Fault
from .field import field_heights
from .phases import MOST_PHASES, Phases, n_phases
from .sampling import reach_px
from .setup import Setup

MOST_BYTES = 2 * 2**30
"""Most memory of a worker for the images of a scene, bytes."""
_COPIES = 4
"""So many arrays of the size of a response are held while it is made."""


@lru_cache(maxsize=64)
def pixels_per_phase(setup: Setup) -> int:
    """Estimate the number of pixels that are computed around a light."""
    target, rows_columns = setup.scene.target, setup.camera.mosaic.indices.shape
    assert target is not None
    reach = reach_px(setup, target)
    return int(np.prod([2 * reach + n + 3 for n in rows_columns]))


@lru_cache(maxsize=64)
def bytes_per_phase(setup: Setup, *, by_pixel: bool) -> int:
    """Estimate the memory of the response at one phase.

    `by_pixel`: single pixels, one field position after the other.
    """
    n = len(setup.camera.mosaic.channels)
    if by_pixel:
        return 8 * _COPIES * pixels_per_phase(setup) * (setup.camera.grid.size + n)
    return 8 * _COPIES * n * n * setup.camera.grid.size * len(field_heights(setup))


def blocks(setup: Setup, phases: Phases) -> list[Phases]:
    """Split phases into blocks whose responses of single pixels fit into half of `MOST_BYTES`."""
    step = max(1, MOST_BYTES // 2 // bytes_per_phase(setup, by_pixel=True))
    return [phases.subset(slice(at, at + step)) for at in range(0, len(phases), step)]


def memory_fault(setup: Setup) -> Fault | None:
    """Return the reason why a target's response is not computed.

    None if it is computed.
    """
    if setup.scene.target is None:
        return None
    channels = f"{len(setup.camera.mosaic.channels)} channels and {setup.camera.grid.size} wavelengths"
    if (needed_bytes := bytes_per_phase(setup, by_pixel=True)) > MOST_BYTES:
        problem = f"{pixels_per_phase(setup):,} pixels around the light, of {channels}, take too much memory"
        return Fault(("target",), problem, f"{needed_bytes / 2**30:.1f} GiB", f"at most {MOST_BYTES / 2**30:g} GiB")
    phases = n_phases(setup)
    if phases > MOST_PHASES:
        problem = f"any sampling phase on a tile of {setup.camera.mosaic.indices.size:,} pixels: too many phases"
        allowed = f"at most {MOST_PHASES:,} (a tile of {MOST_PHASES // 16} pixels), or a named phase"
        return Fault(("target",), problem, f"{phases:,}", allowed)
    if (total := phases * bytes_per_phase(setup, by_pixel=False)) > MOST_BYTES:
        problem = f"{phases:,} sampling phases, of {channels}, take too much memory"
        return Fault(("target",), problem, f"{total / 2**30:.1f} GiB", f"at most {MOST_BYTES / 2**30:g} GiB")
    return None
