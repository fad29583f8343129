"""What an export writes beside the CSV and ISETCam's filters, where it is asked for."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

import numpy as np

from ..base.types import FloatArray
from ..curves.filter_files import speos_text, unique_names
from ..curves.rgb_weights import RgbWeights, rgb_weights
from ..study import Study, folder_name
from .options import Also

_RGB = ("R", "G", "B")


def other_files(
    also: Collection[Also],
    base: Path,
    wavelength_nm: FloatArray,
    curves: Mapping[str, FloatArray],
    study: Study,
    about: str,
) -> tuple[dict[Path, bytes], list[str]]:
    """The files that `also` names, and what is said of them.

    `base`: path of the files without their endings. `curves`: channel -> QE, ndarray[n_wavelengths]. `about`: the
    design, in words. Raises DataError where RGB weights are asked for and the sensor has no curve R, G or B.
    """
    files: dict[Path, bytes] = {}
    lines: list[str] = []
    if Also.SPEOS in also:
        for name, (channel, qe) in zip(unique_names(map(folder_name, curves)), curves.items(), strict=True):
            path = base.with_name(f"{base.name}_{name}.spectrum")
            text = speos_text(wavelength_nm, qe, f"{channel} of {about}: QE in percent, electrons per photon")
            files[path] = text.encode("ascii")
            lines.append(f"       {path} ({channel}: QE in percent, for Speos)")
    if Also.RGB in also:
        rgb = np.stack([study.sensor.curve(name) for name in _RGB])
        found = rgb_weights(curves, rgb, study.lights.photons)
        path = base.with_name(base.name + "_rgb_weights.csv")
        files[path] = found.as_csv().encode("utf-8")
        lines += [f"       {path} (each channel as a sum of the sensor's R, G and B):", *_said(found)]
    return files, lines


def _said(found: RgbWeights) -> list[str]:
    """A line per channel: the weights, and what the sum misses."""
    lines = []
    for channel, weights, residual, error in zip(
        found.channels, found.weights, found.residual, found.light_error, strict=True
    ):
        shown = [round(float(weight), 4) + 0.0 for weight in weights]  # no -0.0000
        terms = " ".join(f"{weight:+.4f} {name}" for weight, name in zip(shown, _RGB, strict=True))
        lines.append(
            f"       {channel} = {terms}; the sum misses {residual:.2%} of the curve (root mean square), and "
            f"of each of the study's lights at most {error:.2%} of the brightest one's electrons."
        )
    return lines
