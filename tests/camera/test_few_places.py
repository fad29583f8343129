"""What is told by few: readouts at places that have mirror images, sums over Bessel functions at some radii."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sweep.camera.bessel import FewRadii, sums_of_j0, sums_of_j1_over_x
from sweep.camera.effects import phase
from sweep.camera.imager import AllApart, Imager
from sweep.camera.methods import REFERENCE

from ..hard.scenes import DARK, F2, FAR, scene


@pytest.mark.parametrize("readout", ["mean", "center"])
@pytest.mark.parametrize(("name", "fewest"), [("RGGB", 15), ("RYNCy", 25), ("1x3", 36), ("3x3", 78)])
def test_a_place_reads_what_its_mirror_images_read(name: str, fewest: int, readout: str) -> None:
    given = {"target": FAR | {"phase_px": "any", "readout": readout}, "optics": F2, "noise": True}
    made = scene("mirrored", name, given, DARK | {"crosstalk": 0.05})
    view = replace(made.view, methods=replace(REFERENCE, phase="quarter pixel"))
    every = phase.cases(view, "quarter pixel")
    few, which = phase.different_places(view, every)
    assert len(few.places_px) == (fewest if readout == "mean" else len(every.places_px))
    imager = Imager(view)
    assert imager.n_places == len(few.places_px)
    own, whole = (each.read_with_noise(made.curves) for each in (imager, AllApart(view)))
    np.testing.assert_allclose(own.mean[:, which], whole.mean, rtol=0, atol=1e-9)
    np.testing.assert_allclose(own.variance[:, which], whole.variance, rtol=1e-9)


@pytest.mark.parametrize("reach", [0.05, 1.0, 80.0])
def test_sums_at_few_radii_tell_those_at_all(reach: float) -> None:
    frequencies = np.linspace(0.01, 1.25, 200)
    spectrum = np.random.default_rng(4).normal(size=(200, 3))
    radii = np.linspace(0, reach, 500)
    few = FewRadii(radii, float(frequencies[-1]))
    for sums in (sums_of_j0, sums_of_j1_over_x):
        found = few.to_all(sums(few.nodes, frequencies, spectrum))
        off = np.abs(found - sums(radii, frequencies, spectrum)).max(axis=0)
        assert (off < 3e-13 * np.abs(spectrum).sum(axis=0)).all()
