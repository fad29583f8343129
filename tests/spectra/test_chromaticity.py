"""Chromaticity against colour-science's own integration, and the color regions of signals."""

from __future__ import annotations

import colour
import numpy as np
import pytest
from colour.colorimetry import dominant_wavelength, excitation_purity

from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.color import REGIONS, color_matching, display_colors, luminance_per_photon_radiance
from sweep.spectra.signal_color import EQUAL_ENERGY, VISIBLE, light_color, spectral_locus
from sweep.spectra.spectrum import WavelengthGrid

GRID = WavelengthGrid()
LIGHTS = BUILT_IN_LIGHTS["tl16"](GRID)


def by_colour_science(photons: np.ndarray) -> np.ndarray:
    wave = np.arange(360.0, 781.0)
    energy = np.pad(photons / GRID.nodes_nm, (40, 80))
    xyz = colour.sd_to_XYZ(colour.SpectralDistribution(energy, wave), method="Integration")
    return np.asarray(colour.XYZ_to_xy(xyz))


def test_the_observer_is_that_of_colour_science_at_every_wavelength() -> None:
    grid = WavelengthGrid(start_nm=350, stop_nm=840)
    functions = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    np.testing.assert_array_equal(color_matching(grid)[:, 10:-10], functions.values.T)
    assert not color_matching(grid)[:, [*range(10), *range(-10, 0)]].any()
    efficiency = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    seen = luminance_per_photon_radiance(grid, np.eye(grid.size))[10:-10]
    power_j = 6.62607015e-34 * 299792458 / (efficiency.wavelengths * 1e-9)
    np.testing.assert_allclose(seen, 683.002 * power_j * efficiency.values, rtol=1e-12)


def test_display_colors_are_those_of_colour_science() -> None:
    wave = np.arange(400.0, 701.0)
    energy = LIGHTS.photons / GRID.nodes_nm
    assert np.array_equal(GRID.nodes_nm, wave)
    xyz = energy @ color_matching(GRID).T
    linear = np.clip(colour.XYZ_to_sRGB(xyz / xyz.max(axis=1, keepdims=True), apply_cctf_encoding=False), 0, None)
    wanted = colour.models.eotf_inverse_sRGB(linear / linear.max(axis=1, keepdims=True))
    np.testing.assert_allclose(display_colors(GRID, LIGHTS.photons), wanted, atol=1e-12)


def test_every_signal_lies_inside_its_color_region() -> None:
    for kind, index in LIGHTS.members.items():
        for row in index:
            xy = by_colour_science(LIGHTS.photons[row])
            assert REGIONS[kind].violation(xy[None])[0] <= 0, (LIGHTS.names[row], xy)


@pytest.mark.parametrize(
    ("kind", "inside", "outside"),
    [
        ("red", (0.700, 0.295), (0.700, 0.285)),
        ("red", (0.690, 0.305), (0.670, 0.330)),
        ("red", (0.690, 0.300), (0.660, 0.300)),
        ("yellow", (0.580, 0.415), (0.600, 0.385)),
        ("yellow", (0.580, 0.415), (0.540, 0.455)),
        ("green", (0.080, 0.550), (0.080, 0.390)),
        ("green", (0.080, 0.550), (0.350, 0.500)),
        ("green", (0.080, 0.550), (0.150, 0.650)),
    ],
)
def test_regions_are_en_12368(kind: str, inside: tuple[float, float], outside: tuple[float, float]) -> None:
    found = REGIONS[kind].violation(np.array([inside, outside]))
    assert found[0] < 0 < found[1]


def test_hues_are_those_of_colour_science() -> None:
    """Mixtures of white and two monochromatic lights; at the red end, where the locus is a point, either may be right."""
    rng, locus = np.random.default_rng(3), spectral_locus()
    hues = 0
    for _ in range(120):
        power = np.full(VISIBLE.size, rng.uniform(0, 0.02))
        power[rng.integers(0, 340, 2)] += rng.dirichlet([0.5, 0.5])
        color = light_color(power * VISIBLE.nodes_nm)
        assert color is not None
        nm, leaves, _ = dominant_wavelength(color.xy, EQUAL_ENERGY)
        if np.hypot(*(leaves - locus[340])) < 1e-3 or np.hypot(*np.subtract(color.xy, EQUAL_ENERGY)) < 1e-2:
            continue
        hues += 1
        assert color.dominant_nm == (float(nm) if nm > 0 else None)
        assert color.purity == pytest.approx(float(excitation_purity(color.xy, EQUAL_ENERGY)), abs=1e-6)
    assert hues > 80
