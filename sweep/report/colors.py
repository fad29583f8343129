"""Colors of a study with the task `color`: error against noise per CFA, and two rendered pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import Array, Float, IndexArray, Int
from ..results.output import Output
from ..results.tables import CHART, NIGHT
from .figures import CURVE_CYCLE, Drawing, canvas, legend_beside, panel_grid

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_TRUE = "the eye"
_PATCH_PX = 14
_COLUMNS = 6
_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])
"""XYZ to linear sRGB, IEC 61966-2-1."""
_WHITE = np.array([0.9505, 1.0, 1.089])
"""XYZ of sRGB's white, D65."""


def error_curves(output: Output) -> dict[str, pd.DataFrame]:
    """Return mean color error over luminance SNR of every design of the first scenario."""
    if output.error_against_noise is None:
        return {}
    rows = output.error_against_noise[output.error_against_noise["scenario"] == output.scenarios[0]]
    return {str(light): curves for light, curves in rows.groupby("light", sort=False)}


def noise_optimal(curve: pd.DataFrame) -> tuple[float, float]:
    """Return SNR and error of a design's noise-optimal matrix."""
    row = curve.iloc[(curve["regularization"] - 1).abs().argmin()]
    return float(row["snr"]), float(row["delta_e_mean"])


def _draw_error_curves(light: str, curves: pd.DataFrame) -> Figure:
    """Draw one line per design; a dot is the noise-optimal matrix. Better is down and to the right."""
    drawn, axes = canvas(8.0, 4.6)
    for (name, curve), color in zip(curves.groupby("name", sort=False), CURVE_CYCLE * 4, strict=False):
        axes.plot(curve["snr"], curve["delta_e_mean"], "-", color=color, label=str(name), linewidth=1.6)
        axes.plot(*noise_optimal(curve), "o", color=color, markersize=6)
    axes.set(xscale="log", xlabel="luminance SNR of 18 % gray")
    axes.set(yscale="log", ylabel="mean color error, CIEDE2000")
    axes.set_title(f"Color error against noise, light {light.upper()}; dot: the noise-optimal matrix")
    legend_beside(axes)
    return drawn


def renderings(output: Output) -> dict[str, dict[str, Float[Array, "_rows _columns 3"]]]:
    """Return pictures as the eye and each design of the first scenario see them, with noise by the study's seed."""
    if output.rendered is None:
        return {}
    rows = output.rendered[output.rendered["design_id"].isna() | (output.rendered["scenario"] == output.scenarios[0])]
    rows = rows.assign(name=rows["name"].fillna(_TRUE))
    return {
        str(picture): {
            str(name): _image(str(picture), areas, np.random.default_rng((output.study.seed, number)))
            for number, (name, areas) in enumerate(seen.groupby("name", sort=False))
        }
        for picture, seen in rows.groupby("picture", sort=False)
    }


def _image(picture: str, areas: pd.DataFrame, rng: np.random.Generator) -> Float[Array, "rows columns 3"]:
    """Return the pixels of a picture, each with its own noise."""
    names = list(areas["area"])
    if picture == CHART:
        patches = np.arange(len(names)).reshape(-1, _COLUMNS)
        at = np.kron(patches, np.ones((_PATCH_PX, _PATCH_PX), dtype=np.intp))
    else:
        at = _street({name: number for number, name in enumerate(names)})
    mean = np.stack(areas["xyz"].to_list())
    spread = np.stack(areas["covariance"].to_list()).reshape(-1, 3, 3)
    values, vectors = np.linalg.eigh(spread)
    roots = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    noise = np.einsum("rcij,rcj->rci", roots[at], rng.standard_normal((*at.shape, 3)))
    return np.asarray((mean[at] + noise) * _WHITE @ _TO_SRGB.T, dtype=float)


def _street(areas: Mapping[str, int]) -> Int[IndexArray, "rows columns"]:
    """Return the area of each pixel of a street at night: road, lines, signals, signs, a car and leaves."""
    height, width = 72, 108
    y, x = np.mgrid[0:height, 0:width]
    street = np.full((height, width), areas["sky"], dtype=np.intp)
    horizon = 30
    street[(y >= horizon - 14) & (y < horizon) & (x < 30)] = areas["wall"]
    street[((x - 92) ** 2 + (1.2 * (y - 22)) ** 2) < 144] = areas["leaves"]
    depth = (y - horizon) / (height - horizon)
    aside = np.abs(x - width / 2)
    road = (y >= horizon) & (aside < 6 + 56 * depth)
    street[(y >= horizon) & ~road] = areas["leaves"]
    street[road] = areas["road"]
    edge = road & (np.abs(aside - (4 + 44 * depth)) < 0.6 + 2.4 * depth)
    street[edge & (x > width / 2)] = areas["white line"]
    street[edge & (x < width / 2)] = areas["yellow line"]
    street[road & (aside < 0.5 + 2.0 * depth) & (y % 12 < 6)] = areas["white line"]
    boxes = {
        "red signal": (4, 9, 66, 71),
        "yellow signal": (10, 15, 66, 71),
        "green signal": (16, 21, 66, 71),
        "red sign": (12, 22, 34, 44),
        "blue sign": (12, 22, 47, 57),
        "brake lamp": (44, 49, 30, 37),
        "turn lamp": (44, 49, 24, 29),
        "emergency lamp": (36, 40, 30, 44),
    }
    street[42:56, 22:52] = areas["sky"]
    for name, (top, bottom, left, right) in boxes.items():
        street[top:bottom, left:right] = areas[name]
    return street


def _draw_renderings(pictures: Mapping[str, Float[Array, "_rows _columns 3"]], title: str) -> Figure:
    """Draw the pictures side by side, in sRGB; colors outside it are clipped."""
    figure, panels = panel_grid(len(pictures), 4, (2.6, 2.1), (0, 0.4))
    for axes, (name, image) in zip(panels, pictures.items(), strict=True):
        linear = np.clip(image, 0.0, 1.0)
        encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        axes.imshow(encoded, interpolation="nearest")
        axes.set_title(name, fontsize=9)
        axes.set_axis_off()
    figure.suptitle(title, fontsize=10)
    return figure


def color_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """Yield the drawings of colors."""
    for number, (light, curves) in enumerate(error_curves(output).items(), 1):
        caption = f"Color error against noise under {light.upper()}, over how much the color matrix weighs noise"
        drawn = curves[["name", "snr", "delta_e_mean", "regularization"]]
        yield f"color-noise-{number}", caption, partial(_draw_error_curves, light, drawn)
    captions = {
        CHART: "A rendering, not a photograph: the chart in daylight through each noise-optimal matrix",
        NIGHT: "A rendering, not a photograph: a street at night under white LEDs, each pixel with the noise of four",
    }
    for number, (picture, seen) in enumerate(renderings(output).items(), 1):
        yield f"rendered-{number}", captions[picture], partial(_draw_renderings, seen, captions[picture])
