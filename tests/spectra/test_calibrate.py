"""The shipped surrogate gives the printed figures, and the script that fits it does what it says."""

from __future__ import annotations

import runpy
from types import SimpleNamespace

import numpy as np
import pytest

from sweep.spectra.builtin.data_sets.tl16 import tl16
from sweep.spectra.builtin.surrogate import (
    FITS,
    parameter_tree,
    surrogate_fit,
)
from sweep.study import load_study

from ..conftest import STUDIES

SCRIPT = SimpleNamespace(**runpy.run_path(str(STUDIES / "notebooks" / "calibrate.py"), run_name="calibrate"))


def test_shipped_parameters_are_inside_the_bounds_and_meet_all_figures() -> None:
    objective = SCRIPT.Objective(SCRIPT.PRINTED)
    shipped = np.array([SCRIPT.value_at(parameter_tree("surrogate"), free.path) for free in objective.free])
    assert ((objective.low <= shipped) & (shipped <= objective.high)).all()
    found = SCRIPT.summary(objective, shipped)
    provenance = parameter_tree("surrogate")["provenance"]
    assert found["figures met"] == provenance["figures"] == 49
    assert round(found["largest CSD error / allowed"], 3) == provenance["largest_csd_error_over_allowed"]
    assert len(objective.free) == provenance["free_parameters"]


@pytest.mark.parametrize("number", range(1, FITS + 1))
def test_every_further_fit_meets_every_printed_figure(number: int) -> None:
    parameters = surrogate_fit(number)
    found = SCRIPT.figures(parameters, SCRIPT.PRINTED)
    figures = [(row, name, value) for row, values in SCRIPT.PRINTED.items() for name, value in values.items()]
    assert len(figures) == 49
    assert [f for f in figures if not abs(found[f[0]][f[1]] - f[2]) <= SCRIPT.allowed(*f[1:])] == []


def test_a_fit_has_its_own_sensor_lamps_and_filters() -> None:
    """Its figures hold for all of them together."""
    shipped, fit = (load_study(STUDIES / "paper.yaml", changes={"sensor": name}) for name in ("ar0820", "ar0820@3"))
    assert (fit.sensor.name, fit.lights.name) == ("ar0820@3", "tl16@3")
    assert np.abs(fit.lights.photons - shipped.lights.photons).max() > 0
    parameters = surrogate_fit(3)
    np.testing.assert_allclose(fit.lights.photons, tl16(fit.grid, parameters).photons)
    (edges,) = (space.points(0, 1)[0] for space in fit.spaces if space.name == "paper_N4")
    assert edges[0] == parameters.stopbands["paper_N4"].left_nm
