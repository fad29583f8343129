"""The light of single pixels in factors, against a loop over pixels, wavelengths and filters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.camera.phases import Phases
from sweep.camera.response import PixelResponse, Responses, SplitLight

from ..hard.scenes import DARK, F2, FAR, DesignScene, scene

CENTERS_PX = np.array([[0.0, 0.0], [0.3, 0.9], [1.6, -0.2]])
PHASES = Phases(CENTERS_PX, np.floor(CENTERS_PX + 0.5))


def pixels(made: DesignScene, psf_step_nm: float | None) -> PixelResponse:
    """Response of pixels at three phases, sharp where no step of wavelengths is given."""
    if psf_step_nm is None:
        return Responses(replace(made.setup, left_out=frozenset({"blur"}))).pixels(PHASES)
    accuracy = made.setup.accuracy.model_copy(update={"psf_step_nm": psf_step_nm})
    return Responses(replace(made.setup, accuracy=accuracy)).pixels(PHASES)


@pytest.mark.parametrize("psf_step_nm", [1e-3, 10.0, None], ids=["every wavelength", "every 10 nm", "sharp"])
def test_sums_are_those_of_the_array(psf_step_nm: float | None) -> None:
    given = {"target": FAR, "optics": F2, "visibility_m": 500, "noise": True}
    made = scene("split", "RYNCy", given, DARK | {"crosstalk": 0.1})
    response = pixels(made, psf_step_nm)
    split = response.source
    assert isinstance(split, SplitLight)
    size = made.setup.camera.grid.size
    rng = np.random.default_rng(1)
    channels = [0, 2, 3]
    spectra = rng.uniform(size=(2, 3, 5, size))
    light = np.broadcast_to(response.light, (*response.light.shape[:3], size))
    expected = np.einsum("xucw,ncsw->nxsu", light[:, :, channels], spectra)
    before = rng.uniform(size=expected.shape)
    found = before.copy()
    split.add_sums(spectra, channels, found)
    np.testing.assert_allclose(found, before + expected, rtol=1e-12)
    # A design is changed by those beside it no more than by the order of its sums.
    alone = before[1:].copy()
    split.add_sums(spectra[1:], channels, alone)
    np.testing.assert_allclose(alone[0], found[1], rtol=1e-12)
    weights = rng.uniform(size=response.shape)
    folded = np.einsum("xu,xuw->xw", weights, response.light[:, :, 3])
    np.testing.assert_allclose(split.folded(weights, 3), folded, rtol=1e-12)
