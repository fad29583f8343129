"""A filter in front of the lens: all channels see its transmission, whatever is asked of it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.designs.families.stopband import Stopband
from sweep.designs.glass import Glass
from sweep.study import load_study

from ..build import one_line, ran

GLASS = """\
study: glass
sensor: ar0820
lights: tl16
wavelengths: {step_nm: 5}
cfas: [RGGB, RYYCy]
designs:
  dark: {cfa: RYYCy, where: lens, to: 0.1, at: {left_nm: 600, left_width_nm: 20, right_nm: 660, right_width_nm: 20}}
sweeps:
  notch:
    cfa: RYYCy
    where: lens
    to: 0.1
    grid: {left_nm: [600, 610], left_width_nm: 20, right_nm: [650, 660], right_width_nm: 20}
constraints: {sensitivity: {min: 0.8}}
search: {space: notch, starts: 2, max_evaluations: 60}
"""


def written(folder: Path, old: str = "", new: str = "") -> Path:
    assert old in GLASS
    path = folder / "glass.yaml"
    path.write_text(GLASS.replace(old, new, 1) if old else GLASS)
    return path


def test_a_row_is_what_a_camera_with_such_curves_reads(tmp_path: Path) -> None:
    """Beside a study whose sensor has the darkened curves from the beginning, but is exposed and compared as before."""
    study = load_study(written(tmp_path))
    ran(study, tmp_path / "out", 1)
    table = pd.read_parquet(tmp_path / "out" / "results.parquet").set_index("name")
    dark = table.loc["dark"]
    nm = study.grid.nodes_nm
    ones = np.ones(nm.size)
    glass = Stopband(nm, ones, 0.1 * ones).curves(np.array([[600.0, 20, 660, 20, 1]]))[0, 0]
    qe = {name: study.sensor.qe[name] for name in ("R", "Y", "Cy")}
    assert dark["sensitivity"] == pytest.approx(
        sum((c * glass).sum() for c in qe.values()) / sum(map(np.sum, qe.values()))
    )
    clear = study.sensor.curve(study.sensor.clear)
    behind = [(qe[c] * glass).sum() for c in ("R", "Y", "Y", "Cy")]
    assert dark["cfa_sensitivity"] == pytest.approx(sum(behind) / (4 * clear.sum()))
    # The brightest channel reads 95 % of the full scale for the white patch; a light has `photon_ratio` of its photons.
    photons = study.lights.photons * study.grid.step_nm
    read = {c: photons @ (q * glass) / max((q * glass).sum() for q in qe.values()) for c, q in qe.items()}
    points = np.stack(list(read.values()), axis=1) * (0.95 * 4095 * study.lights.photon_ratio * nm.size)
    apart = points[study.lights.members["yellow"]][:, None] - points[study.lights.members["red"]]
    assert dark["csd_yellow_red"] == pytest.approx(
        np.sqrt((apart**2).sum(axis=2)).min(), abs=1.8
    )  # whole digital numbers
    best = table.loc["best stopband in front of the lens"]
    assert best["feasible"]
    swept = table[(table["kind"] == "sweep") & table["feasible"]]
    assert best["csd_yellow_red"] >= swept["csd_yellow_red"].max() - 2


def test_its_derivatives_are_those_of_its_curves() -> None:
    nm = np.arange(400.0, 701.0)
    rng = np.random.default_rng(1)
    family = Glass(Stopband(nm, np.ones(nm.size), np.full(nm.size, 0.1)), rng.random((3, nm.size)))
    x = np.array([600.0, 20, 655, 15, 0.8])
    step = np.diag([1e-4] * 4 + [1e-6])
    central = (family.curves(x + step) - family.curves(x - step)) / (2 * step.diagonal())[:, None, None]
    np.testing.assert_allclose(family.gradient(x), central, atol=1e-7)
    reach = np.array([5, 5, 5, 5, 0.1])
    low, high = family.hull(x - reach, x + reach)
    inside = family.curves(x + reach * rng.uniform(-1, 1, (200, 5)))
    assert (inside >= low - 1e-12).all()
    assert (inside <= high + 1e-12).all()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("where: lens, to", "where: lens, base: Y, to", "glass.yaml:7: designs.dark.base: every channel sees a filter"),
        ("where: lens, to", "where: lens, channel: R, to", "designs.dark.channel: every channel sees a filter"),
        ("where: lens, to", "where: lens, technology: pigment, to", "designs.dark.technology: every channel sees"),
        (
            "where: lens, to: 0.1",
            "where: lens, to: G",
            "designs.dark.to: a glass goes to a share of its light (got 'G')",
        ),
        ("cfas: [RGGB, RYYCy]", "cfas: {RGGB: RGGB, RYYCy: {tile: []}}", "cfas."),
        ("RYYCy]\n", "RYYCy]\nboxes: {b: {cfa: RYYCy, where: lens, to: 0.1, box: {left_nm: [3, 4]}}}\n", "boxes.b.box"),
        ("where: lens, to", "where: glass, to", "designs.dark.where: not allowed (got 'glass')"),
        ("where: lens, to", "to", "designs.dark.channel: missing"),
        ("where: lens, to", "where: lens, family: dual, to", "designs.dark.family: dual replaces several channels"),
    ],
)
def test_what_a_glass_cannot_have_is_one_line(tmp_path: Path, old: str, new: str, said: str) -> None:
    with one_line(said, alone=False):
        load_study(written(tmp_path, old, new))
