"""Random scenes by the preset `standard` and a plan, against every effect at the settings of `reference`."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sweep.camera.accuracy import REFERENCE, STANDARD
from sweep.camera.plan import plan_scene

from .random_scenes import RandomScene, columns, random_scene

N_SCENES, TOLERANCE_DN = 80, 0.1
_WITHIN_DN, _WITHIN_SHARE, _MEDIAN_DN = 0.5, 0.002, 0.02
_ARITHMETIC_DN = 1e-9
NOTHING: frozenset[str] = frozenset()
LATTICE = STANDARD.model_copy(update={"finest_phase_px": 0.0})
"""The same phases and field positions, whatever is left out."""


def allowed_dn(made: RandomScene, exact: np.ndarray) -> np.ndarray:
    """Whole numbers without noise step, by one in each channel, where images, moments or places are sampled."""
    setup, scenario = made.setup, made.setup.scene
    sampled = scenario.target is not None or scenario.drive is not None or setup.all_heights
    more = math.sqrt(len(setup.camera.mosaic.channels)) if scenario.noise is None and sampled else 0.0
    return np.maximum(_WITHIN_DN, _WITHIN_SHARE * exact) + more


@pytest.mark.slow
def test_standard_is_near_the_reference_and_omitted_effects_within_their_bound() -> None:
    all_off, far_off = [], []
    for made in map(random_scene, range(N_SCENES)):
        plan = plan_scene(made.name, [made.box], TOLERANCE_DN, STANDARD)
        exact, found, with_all, without = (
            np.concatenate(list(columns(made, *how).values()))
            for how in ((NOTHING, REFERENCE), (plan.left_out, STANDARD), (NOTHING, LATTICE), (plan.left_out, LATTICE))
        )
        off = np.abs(found - exact)
        all_off.append(off)
        if (off > allowed_dn(made, exact)).any():
            far_off.append((made.name, off.max()))
        assert np.abs(with_all - without).max() <= plan.error_bound_dn * (1 + 1e-9) + _ARITHMETIC_DN, made.name
    assert far_off == []
    assert np.median(np.concatenate(all_off)) < _MEDIAN_DN
