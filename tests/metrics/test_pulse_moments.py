"""The worst moment of a pulse behind a readout that clips, against very many moments."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from sweep.camera.accuracy import STANDARD
from sweep.camera.model import SceneModel
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import csd_name, separations

from ..hard.scenes import scene


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
