"""The worst moment of a pulse behind a readout that clips, against very many moments."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sweep.camera.forward import ForwardModel
from sweep.designs.space import Space
from sweep.metrics.evaluate import evaluate
from sweep.metrics.separation import csd_name, separations
from sweep.study.load import load_study

STUDY = load_study(Path("studies/accuracy.yaml"))


@pytest.mark.parametrize("space", STUDY.spaces, ids=lambda space: str(space.name))
def test_no_moment_of_a_pulse_has_a_smaller_csd(space: Space) -> None:
    setup = STUDY.setup(space, "pulsed")
    curves = space.curves(space.points(0, min(space.size, 24)), STUDY.grid.size)
    columns, model = evaluate(ForwardModel(setup), curves), ForwardModel(setup)
    every_moment = model.at(model.phases, np.linspace(0.0, 1.0, 2001))
    for design in range(len(curves)):
        response = every_moment.read(curves[design : design + 1])[0][0]
        for pair, distances in separations(response, setup.members).items():
            assert columns[csd_name(pair)][design] <= distances.min() + 0.05
