"""`sweep describe`: what a file of curves holds, and everything that is wrong with it."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from sweep.base.errors import OutputError, SweepError
from sweep.features.describe.describe import describe
from sweep.spectra.signal_color import VISIBLE, light_color, outline

from ...commanded import commanded
from ...curve_texts import WAVE, bell, csv
from ...late import Late
from ...watchdog import within


@pytest.mark.parametrize(
    ("peak_nm", "region", "signal"),
    [
        *((450, None, None), (503, "green", "green"), (605, "orange", "orange"), (660, None, "red")),
    ],
)
def test_monochromatic_light_lies_in_its_region(peak_nm: int, region: str | None, signal: str | None) -> None:
    spectrum = np.zeros(VISIBLE.size)
    spectrum[int(peak_nm - VISIBLE.start_nm)] = 1.0
    color = light_color(spectrum)
    assert color is not None
    assert color.dominant_nm == pytest.approx(peak_nm, abs=1)
    assert color.purity == pytest.approx(1, abs=1e-6)
    assert (color.region, color.signal) == (region, signal)
    assert (color.distance == 0) == (region is not None)


def test_purple_and_darkness_are_no_signal() -> None:
    purple = np.zeros(VISIBLE.size)
    purple[[90, 290]] = 1.0
    color = light_color(purple)
    assert color is not None
    assert color.dominant_nm is None
    assert color.signal is None
    assert light_color(np.zeros(VISIBLE.size)) is None


def test_distance_is_to_the_nearest_point_of_a_region() -> None:
    spectrum = np.zeros(VISIBLE.size)
    spectrum[int(700 - VISIBLE.start_nm)] = 1.0  # below y = 0.290, along the locus
    color = light_color(spectrum)
    assert color is not None
    dense = np.concatenate(
        [np.linspace(a, b, 500) for a, b in zip(outline("red"), np.roll(outline("red"), -1, axis=0), strict=True)]
    )
    brute = np.sqrt(((dense - np.array(color.xy)) ** 2).sum(axis=1)).min()
    assert color.nearest == "red"
    assert color.distance == pytest.approx(brute, abs=1e-5)


def test_the_command_ends_with_the_picture_or_exit_2(tmp_path: Path) -> None:
    path = csv(tmp_path, "wavelength_nm,R", WAVE, bell(600, 50) - 0.1)
    code, out, said = commanded("describe", path, "--output", tmp_path / "out")
    assert (code, said.count("\n"), "negative value at 380 nm" in said) == (2, 1, True)
    assert str(tmp_path / "out" / "curves.png") in out


def test_a_picture_of_another_stays(tmp_path: Path) -> None:
    path = csv(tmp_path, "wavelength_nm,G", WAVE, 0.5 * bell(540, 50))
    describe(path, output=tmp_path)
    picture = tmp_path / "curves.png"
    assert Late("matplotlib.image").imread(picture).shape[2] == 4
    describe(path, output=tmp_path)
    picture.write_bytes(b"mine")
    with pytest.raises(OutputError, match="holds something else already"):
        describe(path, output=tmp_path)
    assert picture.read_bytes() == b"mine"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
def test_a_pipe_is_no_picture(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "a.png")
    good = csv(tmp_path, "wavelength_nm,R", WAVE, bell(550, 30), name="a.csv")
    with pytest.raises(SweepError, match="not a file"), within(120.0):
        describe(good, output=tmp_path)
