"""The worst moment of a pulse behind a readout that clips, against very many moments."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sweep.camera.accuracy import STANDARD
from sweep.camera.model import SceneModel
from sweep.designs.space import Space
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import csd_name, separations
from sweep.study.load import load_study

from ..hard.scenes import scene

STUDY = load_study(Path("studies/accuracy.yaml"))


@pytest.mark.parametrize("space", STUDY.spaces, ids=lambda space: str(space.name))
def test_no_moment_of_a_pulse_has_a_smaller_csd(space: Space) -> None:
    setup = STUDY.setup(space, "pulsed")
    curves = space.curves(space.points(0, min(space.size, 24)), STUDY.grid.size)
    columns, model = evaluate(SceneModel(setup), curves), SceneModel(setup)
    for design in range(len(curves)):
        response = model.read(curves[design : design + 1], moments=np.linspace(0.0, 1.0, 2001))[0][0]
        for pair, distances in separations(response, setup.members).items():
            assert columns[csd_name(pair)][design] <= distances.min() + 0.05


@pytest.mark.parametrize("places", [None, 3])
def test_no_moment_has_a_smaller_csd_where_whole_numbers_clip(places: int | None) -> None:
    """Pixels of a crosstalking patch are full at different moments; whole numbers step."""
    lit = {"intensity_cd": 800.0, "exposure": {"kind": "fixed", "exposure_s": 5.9e-3}, "optics": {"f_number": 5.0}}
    pulsed = lit | {"drive": {"duty": 0.92, "frequency_hz": 20.0}}
    pixel = {"fill_factor": 0.53, "well_e": 11456.0, "bits": 14, "gain_dn_per_e": 1.19, "crosstalk": 0.14}
    field = {"field": {"cra_max_deg": 20.0, "places": places}} if places else {}
    made = scene("pulsed and full", "RYNCy", pulsed | field, pixel)
    setup = replace(made.setup, accuracy=STANDARD)
    columns = evaluate(SceneModel(setup), made.curves)
    finer = replace(setup, accuracy=STANDARD.model_copy(update={"pwm_moments": 1000}))
    response = SceneModel(finer).read(made.curves)[0][0]
    for pair, distances in separations(response, made.setup.members).items():
        assert columns[csd_name(pair)][0] <= distances.min() + math.sqrt(4), pair
