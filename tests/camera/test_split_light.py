"""The light of single pixels in factors, against a loop over pixels, wavelengths and filters."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from sweep.camera.kernel import Kernel, make_kernel
from sweep.camera.methods import REFERENCE

from sweep.camera.effects import phase
from sweep.camera.pixel_response import SplitLight

from ..hard.scenes import DARK, F2, FAR, Scene, scene
from ..rounding import rounding


def pixels(made: Scene, blurred: str) -> Kernel:
    """Kernel of pixels at three places."""
    places = np.array([[0.0, 0.0], [0.3, 0.9], [1.6, -0.2]])
    cases = phase.Cases(places, np.floor(places + 0.5))
    methods, nodes = replace(REFERENCE, blur=blurred), made.view.grid.nodes_nm
    return make_kernel(made.view, methods, nodes, by_pixel=True, work=Counter(), cases=cases)


@pytest.mark.parametrize("blurred", ["every wavelength", "every 10 nm", "skip"])
@pytest.mark.parametrize("crosstalk", [0.0, 0.1])
def test_sums_are_those_of_the_array(blurred: str, crosstalk: float) -> None:
    given = {"target": FAR, "optics": F2, "visibility_m": 500, "noise": True}
    made = scene("split", "RYNCy", given, DARK | {"crosstalk": crosstalk})
    kernel = pixels(made, blurred)
    split = kernel.source
    assert isinstance(split, SplitLight)
    assert split.shape == kernel.light.shape
    rng = np.random.default_rng(1)
    channels = [0, 2, 3]
    spectra = rng.uniform(size=(2, 3, 5, kernel.light.shape[3]))
    expected = np.einsum("xucw,ncsw->nxsu", kernel.light[:, :, channels], spectra)
    before = rng.uniform(size=expected.shape)
    found = before.copy()
    split.add_sums(spectra, channels, found)
    np.testing.assert_allclose(found, before + expected, rtol=1e-12)
    # A design is changed by those beside it no more than by the order of its sums, over wavelengths, functions and parts.
    alone = before[1:].copy()
    split.add_sums(spectra[1:], channels, alone)
    shares = np.ones((1, split.factor.size)) if split.shares is None else split.shares
    in_size = replace(split, values=np.abs(split.values), shares=np.abs(shares), parts=np.abs(split.parts))
    magnitude = before[1:].copy()
    in_size.add_sums(spectra[1:], channels, magnitude)
    terms = split.factor.size + len(shares) + split.parts.size + 3
    assert (np.abs(alone[0] - found[1]) <= rounding(terms, magnitude[0])).all()
    weights = rng.uniform(size=kernel.shape)
    folded = np.einsum("xu,xuw->xw", weights, kernel.light[:, :, 3])
    np.testing.assert_allclose(split.folded(weights, 3), folded, rtol=1e-12)


def test_a_channel_is_the_mean_of_its_pixels() -> None:
    """The kernel of channels, made on another way, is that of the pixels, weighed as they are read out."""
    made = scene("mean", "RGGB", {"target": FAR, "optics": F2}, DARK | {"crosstalk": 0.1})
    apart = pixels(made, "every wavelength")
    places = np.array([[0.0, 0.0], [0.3, 0.9], [1.6, -0.2]])
    cases = phase.Cases(places, np.floor(places + 0.5))
    nodes = made.view.grid.nodes_nm
    whole = make_kernel(made.view, REFERENCE, nodes, by_pixel=False, work=Counter(), cases=cases)
    np.testing.assert_allclose(np.einsum("xuv,xucw->xvcw", apart.readout, apart.light), whole.light, rtol=1e-11)
