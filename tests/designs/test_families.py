"""Every family: its promises, and its exact gradients against its definition at fifty digits."""

from __future__ import annotations

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest

from sweep.base.errors import SweepError
from sweep.designs.families.dual import Dual
from sweep.designs.families.free_form import FreeForm
from sweep.designs.families.mixture import AbsorptionBands, Mixture
from sweep.designs.families.stopband import MultiStopband, Stopband
from sweep.designs.family import Family, MovedFamily
from sweep.designs.registry import FAMILIES as REGISTERED
from sweep.designs.registry import FamilyOptions, build_family
from sweep.designs.tolerance import ProductionError

from ..cases import thinned
from ..hard.cases_curves import quintic

WAVE = np.arange(400.0, 701.0)
BASE = 0.3 + 0.4 / (1 + np.exp(-(WAVE - 500) / 20))
TARGET = 0.2 + 0.1 * np.sin(WAVE / 40)
SPECTRA = np.stack(
    [np.exp(-(((WAVE - at) / 30) ** 2)) * (1 + 0.1 * np.sin(WAVE / 7)) / 1.1 for at in (480, 560, 610, 640)]
)
CEILING = BASE + 0.05 + 0.02 * np.cos(WAVE / 30)

FAMILIES: dict[str, tuple[Family, np.ndarray]] = {
    "stopband": (Stopband(WAVE, BASE, TARGET), np.array([601.3, 17.0, 652.7, 23.0, 0.8])),
    "multi_stopband": (
        MultiStopband(WAVE, BASE, TARGET, 2),
        np.array([501.3, 17.0, 540.2, 9.0, 0.5, 601.3, 12.0, 652.7, 23.0, 0.9]),
    ),
    "dual": (Dual(WAVE, BASE, CEILING), np.array([601.3, 17.0, 652.7, 23.0, 0.8])),
    "free_form": (FreeForm(WAVE, BASE, np.array([550.0, 600.0, 613.5, 690.0])), np.array([1.0, 0.2, 0.5, 0.9])),
    "absorption_bands": (AbsorptionBands(WAVE, BASE, 2), np.array([601.3, 37.0, 0.8, 652.7, 23.0, 1.3, 0.02])),
    "mixture": (Mixture(WAVE, BASE, SPECTRA, 2), np.array([2.0, 0.8, 4.0, 0.3, 1.1])),
}
EDGELESS = ("free_form", "absorption_bands", "mixture")
"""Families without edges."""


def test_every_family_is_tested() -> None:
    assert set(FAMILIES) == set(REGISTERED)


def exact_curves(name: str, x: list[mp.mpf], index: int) -> list[mp.mpf]:
    """The modified channels at one wavelength, from the families' definitions."""
    wavelength, base, target, ceiling = (mp.mpf(float(v[index])) for v in (WAVE, BASE, TARGET, CEILING))
    if name == "free_form":
        nodes = [mp.mpf(n) for n in (550, 600, 613.5, 690)]
        for (a, ta), (b, tb) in pairwise(zip(nodes, x, strict=True)):
            if a <= wavelength <= b:
                return [base * (ta + (tb - ta) * (wavelength - a) / (b - a))]
        return [base]
    if name == "absorption_bands":
        absorbance = x[-1]
        for peak, fwhm, height in zip(*(x[i:-1:3] for i in range(3)), strict=True):
            absorbance += height * mp.exp(-4 * mp.log(2) * ((1 / wavelength - 1 / peak) * peak**2 / fwhm) ** 2)
        return [base * mp.mpf(10) ** -absorbance]
    if name == "mixture":
        one, other = (mp.mpf(float(SPECTRA[int(mp.nint(x[at])) - 1, index])) for at in (0, 2))
        return [base * mp.mpf(10) ** (-(x[1] * one + x[3] * other) * x[4] / mp.mpf("0.8"))]
    shape = mp.mpf(0)
    for left, left_width, right, right_width, depth in zip(*(x[i::5] for i in range(5)), strict=True):
        shape += depth * (quintic(wavelength, left, left_width) - quintic(wavelength, right, right_width))
    if name == "dual":
        swing = min(base, ceiling - base) * shape
        return [base - swing, base + swing]
    return [base + (target - base) * shape]


@pytest.mark.parametrize("name", thinned(FAMILIES))
def test_curves_and_gradients_agree_with_their_definitions_at_fifty_digits(name: str) -> None:
    family, x = FAMILIES[name]
    at = [int(i) for i in np.random.default_rng(3).choice(np.arange(90, 295), 12, replace=False)]
    curves, gradient = family.curves(x[None])[0], family.gradient(x)
    with mp.workdps(50):
        exact_x = [mp.mpf(float(v)) for v in x]
        for index in at:
            values = exact_curves(name, exact_x, index)
            np.testing.assert_allclose(curves[:, index], [float(v) for v in values], rtol=1e-13)
            for k in range(x.size):
                derivative = [
                    mp.diff(
                        lambda p, k=k, c=c, i=index: exact_curves(name, [*exact_x[:k], p, *exact_x[k + 1 :]], i)[c],
                        exact_x[k],
                    )
                    for c in range(family.n_modified)
                ]
                np.testing.assert_allclose(gradient[k, :, index], [float(d) for d in derivative], rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("name", list(FAMILIES))
def test_conditions_and_dimensions_are_linear(name: str) -> None:
    family, x = FAMILIES[name]
    other = x * 1.01
    slope = family.violation_gradient(x)
    np.testing.assert_allclose(family.violation(other[None])[0], family.violation(x[None])[0] + slope @ (other - x))
    if name == "multi_stopband":
        assert (family.dimensions["edge_width_nm"] @ x).tolist() == [17.0, 9.0, 12.0, 23.0]
        np.testing.assert_allclose(family.dimensions["band_width_nm"] @ x, [38.9, 51.4])
    assert set(family.dimensions) == (set() if name in EDGELESS else {"edge_width_nm", "band_width_nm"})


@pytest.mark.parametrize("name", ["stopband", "multi_stopband", "free_form", "absorption_bands", "mixture"])
def test_production_moves_the_shape_that_a_family_names(name: str) -> None:
    family, x = FAMILIES[name]
    assert isinstance(family, MovedFamily)
    fixed, base_transmission = family.moved
    shape = (family.curves(x[None])[0, 0] - fixed) / base_transmission
    came_out = (family.perturbed(ProductionError(-4.0)).curves(x[None])[0, 0] - fixed) / base_transmission
    np.testing.assert_allclose(came_out[:-4], shape[4:], rtol=1e-12, atol=1e-14)


def assert_smooth_and_bounded(family: Family, x: np.ndarray) -> None:
    """Its gradient is that of differences, and a box of one design is that design."""
    step = 1e-6 * np.where(family.gradient(x).any(axis=(1, 2)), np.maximum(np.abs(x), 1), 0)
    for k in np.flatnonzero(step):
        moved = step * (np.arange(x.size) == k)
        ends = family.curves(np.stack([x + moved, x - moved]))
        np.testing.assert_allclose(family.gradient(x)[k], (ends[0] - ends[1]) / (2 * step[k]), atol=1e-8)
    for end, bound in zip(family.hull(x, x), (family.lower(x, x), family.upper(x, x)), strict=True):
        np.testing.assert_allclose(end, family.curves(x[None])[0], rtol=1e-12)
        assert (bound <= end + 1e-12).all()


@pytest.mark.parametrize("name", ["absorption_bands", "mixture"])
def test_a_film_that_is_too_thick_absorbs_more(name: str) -> None:
    family, x = FAMILIES[name]
    off = family.perturbed(ProductionError(0.0, 0.1))
    absorbed, more = (-np.log10(made.curves(x[None])[0, 0] / BASE) for made in (family, off))
    np.testing.assert_allclose(more, 1.1 * absorbed, rtol=1e-12, atol=1e-14)
    assert_smooth_and_bounded(off, x)


@pytest.mark.parametrize("name", ["absorption_bands", "mixture"])
def test_bands_of_a_film_may_be_broader_with_equal_area(name: str) -> None:
    """One colorant alone: 1.3 times as wide about its peak, 1 / 1.3 as high, and then 2 nm to the red."""
    if name == "mixture":
        family, x = Mixture(WAVE, BASE, SPECTRA, 1), np.array([2.0, 0.8, 0.8])
    else:
        family, x = AbsorptionBands(WAVE, BASE, 1, "wavelength"), np.array([601.0, 37.0, 0.8, 0.0])
    off = family.perturbed(ProductionError(2.0, 0.0, 0.3))
    absorbed, broader = (-np.log10(made.curves(x[None])[0, 0] / BASE) for made in (family, off))
    peak_nm = WAVE[absorbed.argmax()]
    expected = np.interp(peak_nm + (WAVE - 2 - peak_nm) / 1.3, WAVE, absorbed) / 1.3
    np.testing.assert_allclose(broader, expected, atol=1e-10 if name == "mixture" else 5e-4)
    assert_smooth_and_bounded(off, x)


def test_bands_that_are_gaussian_in_wavelength_are_symmetric() -> None:
    family = AbsorptionBands(WAVE, BASE, 1, "wavelength")
    ratio = -np.log10(family.curves(np.array([[600.0, 30.0, 0.7, 0.0]]))[0, 0] / BASE)
    np.testing.assert_allclose(ratio[[185, 200, 215]], [0.35, 0.7, 0.35], rtol=1e-12)
    assert_smooth_and_bounded(family, np.array([603.0, 31.0, 0.7, 0.1]))


def test_hard_amounts_leave_numbers() -> None:
    """1e-300 of a colorant is as none, 1e3 leaves nothing; the gradient stays finite."""
    family, _ = FAMILIES["mixture"]
    none, all_of_it = family.curves(np.array([[1, 1e-300, 3, 0, 0.8], [3, 1e3, 3, 1e3, 0.8]]))[:, 0]
    np.testing.assert_array_equal(none, BASE)
    assert (all_of_it[180:240] < 1e-30).all()
    assert np.isfinite(family.gradient(np.array([3, 1e3, 3, 1e3, 0.8]))).all()


@pytest.mark.parametrize("name", ["stopband", "multi_stopband", "dual"])
def test_films_that_are_too_thick_stretch_every_edge(name: str) -> None:
    """An edge at c, w wide, comes out at 1.01 c, 1.01 w wide, and then 3 nm farther; so does its derivative."""
    family, x = FAMILIES[name]
    lengths = np.arange(x.size) % 5 != 4
    moved = np.where(lengths, 1.01 * x, x)
    moved[0::5] += 3.0
    moved[2::5] += 3.0
    off = family.perturbed(ProductionError(3.0, 0.01))
    np.testing.assert_allclose(off.curves(x[None]), family.curves(moved[None]), rtol=1e-12)
    by_length = np.where(lengths, 1.01, 1.0)[:, None, None]
    np.testing.assert_allclose(off.gradient(x), by_length * family.gradient(moved), rtol=1e-9, atol=1e-14)


def test_a_family_refuses_unsuitable_options() -> None:
    options = FamilyOptions(bands=2)
    for name, target, given_options in (
        ("stopband", None, FamilyOptions()),
        ("free_form", TARGET, FamilyOptions()),
        ("free_form", None, FamilyOptions()),
        ("stopband", TARGET, options),
        ("multi_stopband", TARGET, FamilyOptions()),
        ("absorption_bands", TARGET, FamilyOptions()),
        ("absorption_bands", None, FamilyOptions(at_most=2)),
        ("mixture", None, FamilyOptions()),
    ):
        with pytest.raises(SweepError, match=r"`to`|goes with|needs `colorants`"):
            build_family(name, WAVE, BASE, target, given_options)


@pytest.mark.parametrize("shift_nm", [0.0, 4.0])
@pytest.mark.parametrize("name", list(FAMILIES))
def test_every_filter_of_a_box_lies_in_its_hull(name: str, shift_nm: float) -> None:
    """Also where edges come out of order; those in order between its bounds; a box of one design is its filter."""
    family, x = FAMILIES[name]
    family = family.perturbed(ProductionError(shift_nm))
    rng = np.random.default_rng(4)
    disordered = 0
    for _ in range(20):
        half = rng.uniform(0, 1, x.size) * np.where(x > 100, 40.0, 0.9 * x)
        low, high = x - half, np.minimum(x + half, [p.high for p in family.parameters])
        points = low + (high - low) * np.round(rng.uniform(-0.3, 1.3, (300, x.size)).clip(0, 1), 1)
        curves, ordered = family.curves(points), (family.violation(points) <= 0).all(axis=1)
        disordered += int((~ordered).sum())
        for (lower, upper), seen in (
            (family.hull(low, high), curves),
            ((family.lower(low, high), family.upper(low, high)), curves[ordered]),
        ):
            assert (seen >= lower - 1e-12).all()
            assert (seen <= upper + 1e-12).all()
    assert disordered > 100 or name in EDGELESS
    for end in family.hull(x, x):
        np.testing.assert_allclose(end, family.curves(x[None])[0], atol=1e-15)
