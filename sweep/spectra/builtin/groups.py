"""Groups of spectra of the package, measured and modeled, by name."""

from __future__ import annotations

import numpy as np

from ...base.types import Array, Float
from ..spectrum import WavelengthGrid
from . import spectra, surrogate_spectra


def groups() -> dict[str, int]:
    """Return the names of all groups with their sizes."""
    shipped = {name: len(members) for name, members in spectra.shipped_groups().items()}
    return shipped | {name: len(shapes) for name, shapes in surrogate_spectra.SURROGATES.items()}


def is_surface(group: str) -> bool:
    """Return whether a group has surfaces.

    False for lamps.
    """
    if group in surrogate_spectra.SURROGATES:
        return surrogate_spectra.is_sheeting(group)
    return spectra.shipped_groups()[group][0].kind == "reflectance"


def spectra_of_group(grid: WavelengthGrid, name: str, most: int | None = None) -> Float[Array, "spectra wavelengths"]:
    """Return the spectra of a named group on a grid, one per row.

    `most`: number at most, evenly spaced.
    """
    if name in surrogate_spectra.SURROGATES:
        return np.stack([shape.on(grid) for shape in surrogate_spectra.SURROGATES[name]])
    members = spectra.shipped_groups()[name]
    count = len(members) if most is None else min(most, len(members))
    chosen = np.unique(np.linspace(0, len(members) - 1, count).round().astype(int))
    return np.stack([spectra.gridded(grid, members[at]) for at in chosen])
