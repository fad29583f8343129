"""Errors against sums over every readout, which share no code with them."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from sweep.camera.model import SceneModel
from sweep.camera.noise import errors as confusion
from sweep.camera.pixel import Pixel
from sweep.metrics.discrimination import detectability, error_of
from sweep.metrics.evaluate import evaluate
from sweep.study import load_study

from .. import readout_oracle

ONE, OTHER = np.array([0]), np.array([1])
_FACTOR = 1.2
_MOST_READOUTS = 1_000_000
"""A pair with more is compared in fewer channels."""
Numbers = tuple[int, np.ndarray]


def summed(electrons: np.ndarray, pixel: Pixel) -> Numbers:
    """First number and how often each occurs, of the sum of independent pixels."""
    first, shares = 0, np.ones(1)
    known: dict[float, Numbers] = {}
    for n in electrons:
        if n not in known:
            numbers, often = readout_oracle.digital_numbers(float(n), pixel)
            kept = np.flatnonzero(often > 1e-20)
            known[n] = int(numbers[kept[0]]), often[kept[0] : kept[-1] + 1]
        own_first, own = known[n]
        first, shares = first + own_first, np.convolve(shares, own)
    return first, shares


def exact(ours: list[np.ndarray], theirs: list[np.ndarray], pixel: Pixel) -> float:
    """The least error between two signals: half the sum of the lesser of both, over all readouts of all channels."""
    p, q = np.ones(1), np.ones(1)
    for a, b in zip(ours, theirs, strict=True):
        (low_a, own_a), (low_b, own_b) = summed(a, pixel), summed(b, pixel)
        low, high = min(low_a, low_b), max(low_a + own_a.size, low_b + own_b.size)
        first, second = np.zeros(high - low), np.zeros(high - low)
        first[low_a - low : low_a - low + own_a.size] = own_a
        second[low_b - low : low_b - low + own_b.size] = own_b
        some = np.maximum(first, second) > 1e-20
        first, second = first[some], second[some]
        p, q = np.outer(p, first).ravel(), np.outer(q, second).ravel()
        kept = np.maximum(p, q) > 1e-16
        p, q = p[kept], q[kept]
    return float(0.5 * np.minimum(p, q).sum())


def random_pair(seed: int) -> tuple[Pixel, list[np.ndarray], list[np.ndarray]]:
    """A pixel, and what each pixel of each channel expects of two signals that are 0 to 7 deviations apart."""
    rng = np.random.default_rng([seed, 29])
    pixel = Pixel(
        bits=int(rng.integers(8, 17)),
        well_e=float(10 ** rng.uniform(1.3, 6)),
        offset_dn=float(rng.uniform(0, 40)) if rng.uniform() < 0.7 else 0.0,
    )
    wide = rng.uniform() < 0.15  # up to 100 DN of noise in one channel, else 3 DN in up to three
    most_dn = 100 if wide else 3
    read_e = min(10 ** rng.uniform(-1, 1.5), most_dn / pixel.dn_per_e) if rng.uniform() < 0.8 else 0.0
    pixel = pixel.model_copy(update={"read_noise_e": float(read_e)})
    channels = 1 if wide else int(rng.integers(1, 4))
    most_e = min(pixel.well_e * 1.05, (most_dn / pixel.dn_per_e) ** 2 + 3)
    base = float(most_e * 10 ** rng.uniform(-3, 0))
    noise = np.sqrt(base + pixel.read_noise_e**2 + 0.2 / pixel.dn_per_e**2)
    pixels = [int(rng.integers(1, 4)) for _ in range(channels)]
    ours = [np.full(n, base * rng.uniform(0.3, 1)) for n in pixels]
    apart = [noise * rng.uniform(-1, 7) / np.sqrt(sum(pixels)) for _ in pixels]
    theirs = [np.maximum(a + d, 0.0) for a, d in zip(ours, apart, strict=True)]
    return pixel, ours, theirs


def claimed(pixel: Pixel, ours: list[np.ndarray], theirs: list[np.ndarray]) -> float:
    """Error as a study states it for a patch."""
    ends = np.cumsum([0, *(a.size for a in ours)])
    channels = [np.arange(low, high) for low, high in pairwise(ends)]
    electrons = np.stack([np.concatenate(ours), np.concatenate(theirs)])[None]
    return float(confusion.errors(electrons, channels, pixel, {"a": ONE, "b": OTHER})["a", "b"][0])


def check(seed: int) -> None:
    pixel, ours, theirs = random_pair(seed)
    sizes = [max(summed(side[c], pixel)[1].size for side in (ours, theirs)) for c in range(len(ours))]
    while len(sizes) > 1 and np.prod(sizes) > _MOST_READOUTS:
        sizes, ours, theirs = sizes[:-1], ours[:-1], theirs[:-1]
    error = claimed(pixel, ours, theirs)
    least = exact(ours, theirs, pixel)
    assert least / _FACTOR <= error <= _FACTOR * least + 1e-15, (seed, error, least)


@pytest.mark.parametrize("seed", range(30))
def test_errors_of_a_few_pixels_are_exact(seed: int) -> None:
    check(seed)


@pytest.mark.parametrize("seed", range(20))
def test_gaussian_errors_are_within_a_factor_of_the_exact_ones_where_they_are_used(seed: int) -> None:
    """Where read noise is 0.7 DN, or 4 steps of a pixel, and no end of the ADC is near."""
    rng = np.random.default_rng([seed, 31])
    read = float(10 ** rng.uniform(-0.5, 1))
    pixel = Pixel(bits=int(rng.integers(8, 13)), well_e=float(10 ** rng.uniform(3, 5)), read_noise_e=read, offset_dn=60)
    pixels = int(rng.choice([1, 4, 16]))
    base = float(pixel.well_e * 10 ** rng.uniform(-2, -0.5))
    noise = np.sqrt(base + read**2) / np.sqrt(pixels)
    ours, theirs = [np.full(pixels, base)], [np.full(pixels, base + noise * rng.uniform(0, 7))]
    stats = [readout_oracle.moments(float(side[0][0]), pixel) for side in (ours, theirs)]
    mean, variance = (np.array([[[s[k]] for s in stats]]) for k in (0, 1))
    dithered = pixel.dn_per_e * read >= 0.7 and pixel.offset_dn > 5 * pixel.dn_per_e * read
    if dithered or variance.min() * pixels >= 16:
        found = error_of(detectability(mean, variance / pixels, ONE, OTHER))[0]
        assert found >= exact(ours, theirs, pixel) / _FACTOR


def test_nan_of_one_design_leaves_others_unchanged() -> None:
    electrons = np.array([[[5.0], [50.0]], [[np.nan], [50.0]], [[5.0], [np.inf]]])
    found = confusion.errors(electrons, [np.array([0])], Pixel(read_noise_e=2.0), {"a": ONE, "b": OTHER})
    assert np.isnan(found["a", "b"]).tolist() == [False, True, False]


def test_where_exact_sums_are_too_many_the_noise_is_gaussian(tmp_path: Path) -> None:
    pixel = {"bits": 12, "well_e": 2e6, "prnu": 0.05, "read_noise_e": 1e4}
    path = tmp_path / "deep.yaml"
    path.write_text(
        "study: deep\nseed: 1\nsensor: ar0820\nlights: tl16\ncfas: [RYYCy]\nrecognition: {states: [yellow, red]}\n"
        f"pixel: {pixel}\nscenarios: {{dim: {{noise: true, exposure: {{kind: white_patch, level: 0.3}}}}}}\n"
    )
    study = load_study(path)
    imager = SceneModel(study.setup(study.spaces[0], "dim"))
    curves = np.empty((1, 0, study.grid.size))
    assert confusion.few_pixels(imager.setup.scene, imager.setup.camera.pixel, imager.setup.camera.mosaic) is False
    own = imager.own_views[0].image.pixels_of_channels()
    found = evaluate(imager, curves, ["yellow", "red"])
    members = {name: imager.setup.members[name] for name in ("yellow", "red")}
    summed_up = confusion.errors(imager.pixel_electrons(curves)[0, :, 0], own, imager.readout.pixel, members)
    error = summed_up["yellow", "red"]
    assert error > 1e-9, error
    assert error / _FACTOR <= found["error_yellow_red"] <= 2 * error
