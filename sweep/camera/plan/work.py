"""How much computing a scene takes."""

from __future__ import annotations

import numpy as np

from ..effects import blur, flicker, phase, quadrature, sampling
from ..view import Methods, Setup

_NOISE_COST = 8
"""A pixel through the table of the mean readout costs about as much as this many multiplications."""


def estimated_work(setup: Setup, n_designs: int, methods: Methods) -> float:
    """Estimated operations of a run of all designs."""
    target = setup.scenario.target
    grid, signals = setup.grid.size, len(setup.lights.photons)
    channels = len(setup.mosaic.channels)
    straight = methods.saturation == "skip" and methods.quantization == "skip"
    cases, pixels, kernel = 1.0, float(channels), 0.0
    if target is not None and methods.sampling != "skip":
        cases = float(phase.n_places(setup, methods.phase))
        across = 2 * sampling.radii_px(setup, target)[1] + 1
        places = max(across, 2.0 * max(setup.mosaic.indices.shape)) ** 2
        pixels = channels if straight else places
        waves = 1 if methods.blur == "skip" else blur.knots(setup.grid.nodes_nm, methods.blur).size
        kernel = cases * places * channels * waves + (200 * places * waves if methods.blur != "skip" else 0)
    elif target is not None and methods.blur != "skip":
        kernel = 500.0 * blur.knots(setup.grid.nodes_nm, methods.blur).size
    nodes = quadrature.nodes(grid, methods.quadrature).size
    touched = pixels * max(len(setup.modified), 1) / channels
    scales = len(flicker.scales(setup, methods.flicker, np.ones(1))[0])
    values = cases * scales * signals
    each = values / scales * touched * nodes + values * channels * signals / 2
    if methods.saturation != "skip":
        each += values * pixels * (_NOISE_COST if setup.scenario.noise is not None and methods.noise != "skip" else 1)
    each += values * pixels if methods.quantization != "skip" else 0.0
    return kernel + n_designs * each
