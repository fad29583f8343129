"""Random scenes by the preset `standard` and a plan, against every effect at the settings of `reference`."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from sweep.camera.accuracy import REFERENCE, STANDARD
from sweep.camera.plan import plan_scene

from .random_scenes import RandomScene, columns, random_scene

N_SCENES, TOLERANCE_DN = 200, 0.1
_WITHIN_DN, _WITHIN_SHARE, _MEDIAN_DN = 0.5, 0.002, 0.02
_ARITHMETIC_DN = 1e-9
NOTHING: frozenset[str] = frozenset()
LATTICE = STANDARD.model_copy(update={"finest_phase_px": 0.0})
"""The same phases and field positions, whatever is left out."""


@dataclass(frozen=True)
class Compared:
    """A scene's CSDs, ndarray[n], and by how much the plan alone changes one at most."""

    made: RandomScene
    found: np.ndarray
    exact: np.ndarray
    error_bound_dn: float
    changed_dn: float

    @property
    def off_dn(self) -> np.ndarray:
        return np.abs(self.found - self.exact)

    @property
    def allowed_dn(self) -> np.ndarray:
        """Whole numbers without noise step, by one in each channel, where images, moments or places are sampled."""
        setup, scenario = self.made.setup, self.made.setup.scene
        sampled = scenario.target is not None or scenario.drive is not None or setup.all_heights
        more = math.sqrt(len(setup.camera.mosaic.channels)) if scenario.noise is None and sampled else 0.0
        return np.maximum(_WITHIN_DN, _WITHIN_SHARE * self.exact) + more


def compared(seed: int) -> Compared:
    made = random_scene(seed)
    plan = plan_scene(made.name, [made.box], TOLERANCE_DN, STANDARD)
    exact, found = (columns(made, *how) for how in ((NOTHING, REFERENCE), (plan.left_out, STANDARD)))
    with_all, without = (columns(made, left_out, LATTICE) for left_out in (NOTHING, plan.left_out))
    return Compared(
        made,
        np.concatenate(list(found.values())),
        np.concatenate(list(exact.values())),
        plan.error_bound_dn,
        max(float(np.abs(with_all[name] - without[name]).max()) for name in with_all),
    )


@pytest.mark.slow
def test_standard_is_near_the_reference_and_omitted_effects_within_their_bound() -> None:
    every = [compared(seed) for seed in range(N_SCENES)]
    assert [(each.made.name, each.off_dn.max()) for each in every if (each.off_dn > each.allowed_dn).any()] == []
    assert np.median(np.concatenate([each.off_dn for each in every])) < _MEDIAN_DN
    for each in every:
        assert each.changed_dn <= each.error_bound_dn * (1 + 1e-9) + _ARITHMETIC_DN, each.made.name
