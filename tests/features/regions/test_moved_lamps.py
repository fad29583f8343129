"""Limits toward deep red: a red there and one a step before it, evaluated as a lamp of the study."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from sweep.camera.model import SceneModel
from sweep.metrics.evaluate import evaluate
from sweep.results.designs import row_curves
from sweep.spectra.lights import Lights
from sweep.study import load_study

from ...conftest import STUDIES, FinishedFolder

STEP_NM = 0.1


def gauss(nodes_nm: np.ndarray, peak_nm: float) -> np.ndarray:
    """A red of 18 nm FWHM with the photons of the other lamps."""
    photons = np.exp(-np.log(2) * ((nodes_nm - peak_nm) / 9.0) ** 2)
    return photons / np.trapezoid(photons, nodes_nm)


def test_below_rggb_begins_at_the_limit(finished: FinishedFolder) -> None:
    folder, study = finished("stopband"), load_study(STUDIES / "stopband.yaml")
    rows = pd.read_parquet(folder / "designs.parquet").set_index("name", drop=False)
    limits = pd.read_parquet(folder / "lamp_limits.parquet")
    mine = limits[limits["design_id"] == rows.loc["best stopband", "design_id"]]
    for row in mine[mine["shape"] == "Gaussian, 18 nm"].to_dict("records"):
        for limit, inside in ((row["red_limit_nm"], -STEP_NM), (row["yellow_limit_nm"], STEP_NM)):
            below = []
            for peak_nm in (limit, limit + inside):
                found = {}
                for name in ("RGGB", "best stopband"):
                    space, curves = row_curves(study, rows.loc[name].to_dict())
                    setup = study.setup(space, "chart")
                    yellows = setup.lights.photons[setup.members["yellow"]]
                    red = gauss(study.grid.nodes_nm, peak_nm) * np.trapezoid(yellows[0], study.grid.nodes_nm)
                    types = ("yellow",) * len(yellows) + ("red",)
                    names = tuple(f"lamp {at}" for at in range(len(types)))
                    lights = Lights("one", names, types, np.vstack([yellows, red]), setup.lights.photon_ratio, "", True)
                    found[name] = evaluate(SceneModel(replace(setup, lights=lights)), curves)[row["quantity"]][0]
                below.append(bool(found["best stopband"] < found["RGGB"]))
            assert below == [True, False]


@pytest.mark.parametrize(
    ("quantity", "shape", "red_nm"),
    [
        ("csd_yellow_red", "Gaussian, 18 nm", 648.5),
        ("chromatic_csd_yellow_red", "Gaussian, 18 nm", 645.8),
        ("csd_yellow_red", "German", 649.1),
        ("csd_yellow_red", "US", 650.2),
    ],
)
def test_limits_are_those_of_another_program(
    finished: FinishedFolder, quantity: str, shape: str, red_nm: float
) -> None:
    """Where it has a Gaussian; its other shapes are known from a calculation apart, by their true peak."""
    limits = pd.read_parquet(finished("stopband") / "lamp_limits.parquet")
    mine = limits[(limits["quantity"] == quantity) & (limits["shape"] == shape)].iloc[-1]
    assert mine["red_limit_nm"] == pytest.approx(red_nm, abs=0.25)
