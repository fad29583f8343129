"""No named sampling phase has a lower CSD than the column of `any`, over random scenes of small lights."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sweep.camera.accuracy import STANDARD
from sweep.camera.model import SceneModel
from sweep.camera.phases import read_at
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import csd_name, separations
from sweep.spectra.lights import class_pairs

from ..hard.scenes import TILES, DesignScene, scene, target

SCENES, NAMED = 100, 200
_NEVER_CHANGED_DN = 0.05


def small_light(seed: int) -> DesignScene:
    """A light of 0.7 to 12 px anywhere; half of the scenes without noise, a quarter with pixels that may saturate."""
    rng = np.random.default_rng([seed, 29])
    across_px, f_number = float(np.exp(rng.uniform(math.log(0.7), math.log(12.0)))), float(2 ** rng.uniform(0.5, 3))
    distance_m = 0.1 / math.tan(math.radians(across_px * 30 / 3840) / 2)
    light = target(distance_m, 30, phase_px="any", readout="center" if rng.uniform() < 0.4 else "mean")
    noisy = seed % 2 == 0
    given: dict[str, Any] = {"target": light, "optics": {"f_number": f_number}, "noise": noisy}
    if seed % 4 > 1:
        time_s = float(10 ** rng.uniform(-2.3, -1.5)) * (f_number / 2) ** 2
        given |= {"intensity_cd": 200, "exposure": {"kind": "fixed", "exposure_s": time_s}}
    pixel: dict[str, Any] = {"read_noise_e": float(rng.uniform(1, 5)), "offset_dn": 64.0} if noisy else {}
    pixel |= {"crosstalk": float(rng.choice([0.0, 0.05])), "fill_factor": float(rng.uniform(0.5, 1))}
    return scene(f"small light {seed}", str(rng.choice(list(TILES))), given, pixel, seed=seed)


def allowed_dn(made: DesignScene) -> float:
    """Readouts in whole numbers without noise step between phases."""
    return _NEVER_CHANGED_DN if made.setup.scene.noise else math.sqrt(len(made.setup.camera.mosaic.channels))


def lower_by_dn(made: DesignScene, seed: int) -> float:
    """By how much a named phase has a lower CSD than the worst of all, at most."""
    setup = replace(made.setup, accuracy=STANDARD)
    worst = evaluate(SceneModel(setup), made.curves)
    light = setup.scene.target
    rows, columns = setup.camera.mosaic.indices.shape
    named_px = np.random.default_rng([seed, 31]).uniform(0, (columns, rows), (NAMED, 2))
    model = SceneModel(setup)
    response = model.read(made.curves, [*model.views(read_at(light, named_px))])[0][0]
    distances = separations(response, setup.members)
    return max(float(worst[csd_name(pair)][0] - distances[pair].min()) for pair in class_pairs(setup.lights.classes))


def test_a_named_phase_is_read_as_among_others() -> None:
    """What the test below relies on."""
    made = small_light(4)
    light = made.setup.scene.target
    named = light.model_copy(update={"phase_px": (0.3, 0.85)})
    setup = replace(made.setup, scene=made.setup.scene.model_copy(update={"target": named}))
    model = SceneModel(made.setup)
    among = model.read(made.curves, [*model.views(read_at(light, np.array([[0.3, 0.85], [1.2, 0.4]])))])[0]
    np.testing.assert_allclose(SceneModel(setup).read(made.curves)[0][:, 0], among[:, 0], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, SCENES, 10))
def test_no_named_phase_is_worse_than_the_worst_of_all(first: int) -> None:
    for seed in range(first, first + 10):
        made = small_light(seed)
        assert lower_by_dn(made, seed) <= allowed_dn(made), made.name
