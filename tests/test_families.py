"""Every family: its promises, and its exact gradients against mpmath or central differences of a polynomial."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sweep.errors import SweepError
from sweep.families import CHANNELS, Dual, Family, FamilyOptions, FreeForm, Stopband, build_family

WAVE = np.arange(400.0, 701.0)
BASE = 0.3 + 0.4 / (1 + np.exp(-(WAVE - 500) / 20))
TARGET = 0.2 + 0.1 * np.sin(WAVE / 40)
CEILING = BASE + 0.05 + 0.02 * np.cos(WAVE / 30)

FAMILIES: dict[str, tuple[Family, np.ndarray]] = {
    "stopband": (Stopband(WAVE, BASE, TARGET), np.array([601.3, 17.0, 652.7, 23.0, 0.8])),
    "multi_stopband": (
        Stopband(WAVE, BASE, TARGET, 2),
        np.array([501.3, 17.0, 540.2, 9.0, 0.5, 601.3, 12.0, 652.7, 23.0, 0.9]),
    ),
    "dual": (Dual(WAVE, BASE, CEILING), np.array([601.3, 17.0, 652.7, 23.0, 0.8])),
    "free_form": (FreeForm(WAVE, BASE, np.array([550.0, 600.0, 613.5, 690.0])), np.array([1.0, 0.2, 0.5, 0.9])),
}


def test_every_family_is_tested() -> None:
    assert set(FAMILIES) == set(CHANNELS)


@pytest.mark.parametrize("name", list(FAMILIES))
def test_shapes_and_names(name: str) -> None:
    family, x = FAMILIES[name]
    n = len(family.parameters)
    assert family.kind == name
    assert x.shape == (n,)
    assert len({p.name for p in family.parameters}) == n
    assert family.n_modified == CHANNELS[name]
    block = np.stack([x, x, x])
    assert family.curves(block).shape == (3, family.n_modified, 301)
    assert family.gradient(x).shape == (n, family.n_modified, 301)
    conditions = family.violation(block)
    assert family.violation_gradient(x).shape == (conditions.shape[1], n)
    assert (conditions <= 0).all()


@pytest.mark.parametrize("name", list(FAMILIES))
def test_gradients_agree_with_differences(name: str) -> None:
    # The edges are quintic in nm, so the central difference errs by h^2/6 times their third derivative: < 2e-8 here.
    family, x = FAMILIES[name]
    step = 1e-4
    for index, exact in enumerate(family.gradient(x)):
        shift = np.eye(x.size)[index] * step
        ends = family.curves(np.stack([x + shift, x - shift]))
        np.testing.assert_allclose(exact, (ends[0] - ends[1]) / (2 * step), atol=2e-8)
        conditions = family.violation(np.stack([x + shift, x - shift]))
        numeric = (conditions[0] - conditions[1]) / (2 * step)
        np.testing.assert_allclose(family.violation_gradient(x)[:, index], numeric, atol=1e-8)


@settings(max_examples=100)
@given(st.floats(450, 650), st.floats(0, 60), st.floats(500, 720), st.floats(0, 60), st.floats(0, 1))
def test_dual_keeps_the_sum_and_the_ceiling(left: float, lw: float, right: float, rw: float, depth: float) -> None:
    family = Dual(WAVE, BASE, CEILING)
    x = np.array([[left, lw, right, rw, depth]])
    a, b = family.curves(x)[0]
    np.testing.assert_allclose(a + b, 2 * BASE, rtol=1e-15)
    if (family.violation(x) <= 0).all():
        assert (a >= -1e-15).all()
        assert (b <= np.maximum(CEILING, BASE) + 1e-15).all()


@settings(max_examples=100)
@given(st.lists(st.floats(0, 40), min_size=8, max_size=8), st.lists(st.floats(0, 1), min_size=2, max_size=2))
def test_well_formed_bands_do_not_overlap(gaps: list[float], depths: list[float]) -> None:
    family = Stopband(WAVE, BASE, TARGET, 2)
    l1 = 460 + gaps[0]
    r1 = l1 + gaps[1]
    l2 = r1 + gaps[2]
    r2 = l2 + gaps[3]
    x = np.array([[l1, gaps[4], r1, gaps[5], depths[0], l2, gaps[6], r2, gaps[7], depths[1]]])
    if (family.violation(x) <= 0).all():
        curve = family.curves(x)[0, 0]
        assert (curve >= np.minimum(BASE, TARGET) - 1e-15).all()
        assert (curve <= np.maximum(BASE, TARGET) + 1e-15).all()


def test_free_form_is_linear_between_its_nodes_and_the_base_outside() -> None:
    family, x = FAMILIES["free_form"]
    ratio = family.curves(x[None])[0, 0] / BASE
    assert (ratio[:150] == 1).all()
    assert (ratio[291:] == 1).all()
    np.testing.assert_allclose(ratio[150:291], np.interp(WAVE[150:291], [550, 600, 613.5, 690], x), rtol=1e-14)


def test_free_form_starts_are_smooth_and_inside() -> None:
    family = FreeForm(WAVE, BASE, np.arange(540.0, 701.0, 2.0))
    x = family.start(np.random.default_rng(1).uniform(size=(50, 3)))
    assert ((x >= 0) & (x <= 1)).all()
    assert np.abs(np.diff(x, axis=1)).max() < 0.2


def test_a_family_refuses_what_does_not_fit() -> None:
    options = FamilyOptions(bands=2)
    for name, target, given_options in (
        ("stopband", None, FamilyOptions()),
        ("free_form", TARGET, FamilyOptions()),
        ("free_form", None, FamilyOptions()),
        ("stopband", TARGET, options),
        ("multi_stopband", TARGET, FamilyOptions()),
    ):
        with pytest.raises(SweepError):
            build_family(name, WAVE, BASE, target, given_options)


@pytest.mark.parametrize("name", list(FAMILIES))
def test_no_filter_of_a_box_exceeds_its_upper_curve(name: str) -> None:
    family, x = FAMILIES[name]
    low, high = np.maximum(x - np.minimum(0.3 * x, 8), 0), np.minimum(x * 1.3, x + 8)
    limits = np.array([p.high for p in family.parameters])
    high = np.minimum(high, limits)
    points = low + (high - low) * np.random.default_rng(2).uniform(size=(2000, x.size))
    points = points[(family.violation(points) <= 0).all(axis=1)]
    assert len(points) > 100
    assert (family.curves(points) <= family.upper(low, high) + 1e-12).all()
