"""Split of the lamps into training, check and test, by the digest of their spectra."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

from ...base.errors import SweepError, ValidationIssue
from ...base.types import IndexArray, Int, PerWavelength
from ...spectra.lights import Lights
from .keys import Vision

TRAIN, CHECK, TEST = "train", "check", "test"
SPLITS = (TRAIN, CHECK, TEST)
"""Splits of the images: to learn from, to stop by, and to be judged on."""


@dataclass(frozen=True)
class Lamps:
    """Signals of each lens's type that a part of the images shows.

    `of_lens`: signals, one array per lens.
    """

    of_lens: tuple[Int[IndexArray, " _lamps"], ...]

    def digests(self, lights: Lights) -> set[str]:
        """Return the digests of the spectra."""
        return {spectrum_digest(lights.photons[i]) for lamps in self.of_lens for i in lamps}


def spectrum_digest(spectrum: PerWavelength) -> str:
    """Return the SHA-256 of a spectrum."""
    return hashlib.sha256(np.ascontiguousarray(spectrum, dtype="<f8").tobytes()).hexdigest()


def split_lamps(lights: Lights, vision: Vision, seed: tuple[int, int]) -> dict[str, Lamps]:
    """Split the lamps of each signal type: half to train, a quarter to check, a quarter to test; one at least.

    Signals with equal spectra are one lamp.

    Raises SweepError if a lamp of the test has the spectrum of another part's.
    """
    rng = np.random.default_rng((*seed, 1))
    parts: dict[str, list[IndexArray]] = {part: [] for part in SPLITS}
    for lens in vision.lenses:
        by_digest: dict[str, list[int]] = {}
        for i in lights.members[lens]:
            by_digest.setdefault(spectrum_digest(lights.photons[i]), []).append(int(i))
        groups = [by_digest[key] for key in by_digest]
        order = rng.permutation(len(groups))
        n_quarter = max(1, len(groups) // 4)
        for part, numbers in (
            (TEST, order[:n_quarter]),
            (CHECK, order[n_quarter : 2 * n_quarter]),
            (TRAIN, order[2 * n_quarter :]),
        ):
            parts[part].append(np.array([i for at in numbers for i in groups[at]], dtype=np.intp))
    split = {part: Lamps(tuple(by_digest)) for part, by_digest in parts.items()}
    learned = split[TRAIN].digests(lights) | split[CHECK].digests(lights)
    if learned & split[TEST].digests(lights):
        raise SweepError(ValidationIssue("a lamp of the test has the spectrum of one to learn from", key="vision"))
    return split
