"""What `sweep/README.md` says is enough to add something: one new file, and it works everywhere."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import trapezoid
from scipy.spatial.distance import cdist

from sweep.camera.sensor import BUILT_IN_SENSORS
from sweep.spectra.builtin.registry import BUILT_IN_LIGHTS
from sweep.spectra.spectrum import WavelengthGrid

from ..commanded import commanded
from ..late import Late

colour = Late("colour")

WINDSHIELD = '''\
"""A windshield of tinted glass."""

from dataclasses import replace


def windshield(irradiance, scene):
    transmittance = 0.7 ** (550 / irradiance.wavelength_nm)
    signals, background = irradiance.signals * transmittance, irradiance.background * transmittance
    return replace(irradiance, signals=signals, background=background)
'''
DRIVEN = """\
study: NAME
sensor: ar0820
lights: tl16
cfas: [RGGB]
EFFECTS
scenarios:
  chart: {exposure: {kind: fixed, exposure_s: 0.004}, background_cd_m2: 30}
"""

RED_SHARE = '''\
"""How much of the red light a filter lets through."""

import numpy as np
from scipy.sparse import csr_matrix

from sweep.metrics.quantity import LinearRows, Quantity
from sweep.metrics.metric import Metric
from sweep.metrics.smooth import Rows

NAME = "red_share"


def _weights(setup):
    red = np.where(setup.camera.grid.nodes_nm >= 600, 1.0, 0.0)
    return red / (red @ setup.camera.base_qe[0])


def _rows(design):
    weights = _weights(design.setup)
    return Rows(design.curves @ weights, (design.by_u @ weights).T)


class RedShare(Metric):
    order = 9
    needs = "filters"

    def quantities(self, requested):
        return (
            Quantity(
                NAME,
                NAME,
                "QE of the modified channel from 600 nm on, over that of its base",
                label="share of red",
                direction="more",
                ends=("min",),
                goal=True,
                needs="modified",
                smooth=_rows,
                linear=lambda setup: LinearRows(csr_matrix(_weights(setup)[None])),
            ),
        )

    def of_batch(self, batch):
        if not batch.setup.camera.modified:
            return {NAME: np.full(batch.size, np.nan)}
        return {NAME: batch.curves[:, 0] @ _weights(batch.setup)}
'''
WITH_METRIC = """\
study: red
columns: all
sensor: ar0820
lights: tl16
cfas: [RYNCy]
sweeps:
  edges:
    cfa: RYNCy
    channel: N
    base: Y
    to: 0.2
    grid: {left_nm: {min: 590, max: 630, count: 9}, left_width_nm: [6], right_nm: {min: 640, max: 670, count: 4}, right_width_nm: [6], depth: [1]}
constraints: {red_share: {min: 0.8}}
search: {starts: 3, max_evaluations: 150}
"""


ROOM = """\
import sys, sweep.metrics.columns as room
room.__path__.append(sys.argv.pop(1))
from sweep.report import page
page.svg, page.pictures_of = lambda *_: "", lambda *_: {}
from sweep.cli.app import main
main()
"""


@pytest.mark.slow
def test_a_metric_is_one_new_file(tmp_path: Path) -> None:
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "red_share.py").write_text(RED_SHARE)
    (tmp_path / "study.yaml").write_text(WITH_METRIC)
    command = sys.executable, "-c", ROOM, tmp_path / "more", "run", tmp_path / "study.yaml", "--output", tmp_path
    done = subprocess.run([*command, "--jobs", "1"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "red"
    rows = pd.read_parquet(folder / "results.parquet")
    assert set(rows["status"]) == {"ok"}
    # The constraint, the search and the limit know it.
    made = rows[rows["kind"] != "reference"]
    assert (made["feasible"] == (made["red_share"] >= 0.8 * (1 - 1e-9))).all()
    best, swept = rows[rows["kind"] == "search"].iloc[0], made[(made["kind"] == "sweep") & made["feasible"]]
    assert best["red_share"] == pytest.approx(0.8, abs=1e-6)
    assert best["csd_yellow_red"] >= swept["csd_yellow_red"].max() - 1
    search = json.loads((folder / "provenance.json").read_text())["search"]
    assert search["upper_bound_proven"] >= best["csd_yellow_red"] - 1
    assert search["upper_bound_left_out"] == []


def distance_dn(tint: float) -> float:
    """CSD of red and yellow of the study's scene behind a tint, rounded, summed up from curves alone."""
    grid = WavelengthGrid()
    nodes = grid.nodes_nm
    sensor, lights = BUILT_IN_SENSORS["ar0820"](grid), BUILT_IN_LIGHTS["tl16"](grid)
    qe = np.stack([sensor.qe[name] for name in "RGB"]) * tint ** (550.0 / nodes)
    # 2e18 photons/s/sr/m^2 through f/4 onto pixels of 2.1 um, 10,000 e at 4095 DN.
    dn_per_radiance = math.pi / (1 + 4 * 4.0**2) * (2.1e-6) ** 2 * 0.004 * 0.4095
    # 30 cd/m^2, flat in photons: 683 lm/W times V and the energy of a photon, h c / wavelength.
    photopic = colour.SDS_LEFS["CIE 1924 Photopic Standard Observer"]
    seen = np.interp(nodes, photopic.wavelengths, photopic.values, left=0, right=0)
    flat = 30 / (683 * trapezoid(seen * 6.62607015e-34 * 299792458 / (nodes * 1e-9)))
    dn = dn_per_radiance * (2e18 * trapezoid(lights.photons[:, None] * qe) + flat * trapezoid(qe))
    read = np.floor(dn + 0.5)
    return float(cdist(read[lights.members["yellow"]], read[lights.members["red"]]).min())


def test_an_effect_is_a_function_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "windshield.py").write_text(WINDSHIELD)
    study, distances = tmp_path / "driven.yaml", {}
    for name, effects in (("open", ""), ("behind", "effects: [windshield.py:windshield]")):
        study.write_text(DRIVEN.replace("NAME", name).replace("EFFECTS", effects))
        code, _, error = commanded("run", study, "--output", tmp_path / "out", "--jobs", 1, "--allow-code")
        assert code == 0, error
        out = tmp_path / "out" / name
        distances[name] = pd.read_parquet(out / "results.parquet")["csd_yellow_red"].item()
        effects_of_plan = json.loads((out / "provenance.json").read_text())["plans"]["chart"]["effects"]
        assert [e["computed"] for e in effects_of_plan if e["effect"] == "windshield"] == [True] * (name == "behind")
    assert distances["open"] == pytest.approx(distance_dn(1.0), abs=1e-9)
    assert distances["behind"] == pytest.approx(distance_dn(0.7), abs=1e-9)
    assert commanded("check", study)[0] == 2  # no code without being asked
