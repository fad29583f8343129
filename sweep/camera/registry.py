"""Every effect of the image chain, found in `effects`, and what the light meets on its way to the image."""

from __future__ import annotations

import numpy as np

from ..base.found import made_in
from ..base.types import FloatArray
from . import effects
from .effects.base import Chosen, Effect, LightEffect
from .shot import Shot

EFFECTS: dict[str, Effect] = {
    effect.name: effect for effect in sorted(made_in(effects, Effect), key=lambda e: (e.stage, e.order, e.name))
}
"""Each effect by its name, in the order in which effects are switched to their methods."""

WHOLE_LIGHT = {name: effect.methods[0] for name, effect in EFFECTS.items() if isinstance(effect, LightEffect)}
"""The methods by which nothing is taken from the light."""


def factor_of_light(shot: Shot, methods: Chosen, wavelength_nm: FloatArray, *, background: bool = False) -> FloatArray:
    """What all effects together leave of a signal's light, ndarray[n_wavelengths]; `background`: of the background."""
    found = np.ones(wavelength_nm.size)
    for effect in EFFECTS.values():
        if effect.dims_background or not background:
            own = effect.factor(shot, getattr(methods, effect.name), wavelength_nm)
            found = found if own is None else found * own
    return found
