"""Chromaticity against colour-science's own integration, and the color regions of signals."""

from __future__ import annotations

import numpy as np
import pytest

from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.color import REGIONS, chromaticity, color_matching, luminance_per_photon_radiance
from sweep.spectra.signal_color import EQUAL_ENERGY, VISIBLE, light_color, spectral_locus
from sweep.spectra.spectrum import WavelengthGrid

from ..late import Late

colour = Late("colour")

GRID = WavelengthGrid()
LIGHTS = BUILT_IN_LIGHTS["tl16"](GRID)


def test_the_observer_is_that_of_colour_science_at_every_wavelength() -> None:
    grid = WavelengthGrid(start_nm=350, stop_nm=840)
    functions = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    np.testing.assert_array_equal(color_matching(grid)[:, 10:-10], functions.values.T)
    assert not color_matching(grid)[:, [*range(10), *range(-10, 0)]].any()
    efficiency = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    seen = luminance_per_photon_radiance(grid, np.eye(grid.size))[10:-10]
    power_j = 6.62607015e-34 * 299792458 / (efficiency.wavelengths * 1e-9)
    np.testing.assert_allclose(seen, 683.002 * power_j * efficiency.values, rtol=1e-12)


def test_every_signal_lies_inside_its_color_region() -> None:
    for kind, index in LIGHTS.members.items():
        assert (REGIONS[kind].violation(chromaticity(GRID, LIGHTS.photons[index])) <= 0).all()


def test_the_green_region_is_that_of_en_12368() -> None:
    corners = (0.080, 0.550), (0.080, 0.390), (0.350, 0.500), (0.150, 0.650)
    assert list(REGIONS["green"].violation(np.array(corners)) < 0) == [True, False, False, False]


def test_hues_are_those_of_colour_science() -> None:
    """Mixtures of white and two monochromatic lights; at the red end, where the locus is a point, either may be right."""
    rng, locus = np.random.default_rng(3), spectral_locus()
    hues = 0
    for _ in range(120):
        power = np.full(VISIBLE.size, rng.uniform(0, 0.02))
        power[rng.integers(0, 340, 2)] += rng.dirichlet([0.5, 0.5])
        color = light_color(power * VISIBLE.nodes_nm)
        assert color is not None
        nm, leaves, _ = colour.dominant_wavelength(color.xy, EQUAL_ENERGY)
        if np.hypot(*(leaves - locus[340])) < 1e-3 or np.hypot(*np.subtract(color.xy, EQUAL_ENERGY)) < 1e-2:
            continue
        hues += 1
        assert color.dominant_nm == (float(nm) if nm > 0 else None)
        assert color.purity == pytest.approx(float(colour.excitation_purity(color.xy, EQUAL_ENERGY)), abs=1e-6)
    assert hues > 80
