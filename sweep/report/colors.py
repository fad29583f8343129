"""Colors of a study with the task of color: error against noise per CFA, and two pictures as each CFA renders them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ..base.types import FloatArray, IndexArray
from ..results.output import Output
from ..results.tables import CHART, NIGHT
from .figures import CURVE_CYCLE, Drawing, canvas, empty_figure
from .series import Line

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


@dataclass(frozen=True)
class ErrorCurves:
    """Mean color error over luminance SNR of every design under one light: name -> (SNR, error), ndarray[n] each.

    `marked`: the point of the noise-optimal matrix.
    """

    light: str
    curves: Mapping[str, tuple[FloatArray, Line]]
    marked: Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Rendering:
    """A picture as a design renders it, linear sRGB, ndarray[rows, columns, 3]."""

    name: str
    image: FloatArray


def error_curves(output: Output) -> list[ErrorCurves]:
    """A figure's data for each light, of the first scenario."""
    if output.traded is None:
        return []
    rows = output.traded[output.traded["scenario"] == output.scenarios[0]]
    found = []
    for light, own in rows.groupby("light", sort=False):
        curves, marked = {}, {}
        for name, each in own.groupby("name", sort=False):
            curves[str(name)] = each["snr"].to_numpy(), Line(each["delta_e_mean"].to_numpy(), None)
            best = each.iloc[(each["regularization"] - 1).abs().argmin()]
            marked[str(name)] = float(best["snr"]), float(best["delta_e_mean"])
        found.append(ErrorCurves(str(light), curves, marked))
    return found


def draw_error_curves(figure: ErrorCurves) -> Figure:
    """Draw one line per design; a dot is the noise-optimal matrix. Better is down and to the right."""
    drawn, axes = canvas(8.0, 4.6)
    for (name, (x, line)), color in zip(figure.curves.items(), CURVE_CYCLE * 4, strict=False):
        axes.plot(x, line.y, "-", color=color, label=name, linewidth=1.6)
        axes.plot(*figure.marked[name], "o", color=color, markersize=6)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel("luminance SNR of 18 % gray")
    axes.set_ylabel("mean color error, CIEDE2000")
    axes.set_title(f"Color error against noise, light {figure.light.upper()}; dot: the noise-optimal matrix")
    axes.legend(fontsize=8, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False)
    return drawn


def renderings(output: Output) -> dict[str, list[Rendering]]:
    """Picture -> how the eye and each design of the first scenario see it, with noise drawn from the study's seed."""
    if output.rendered is None:
        return {}
    rows = output.rendered[output.rendered["design_id"].isna() | (output.rendered["scenario"] == output.scenarios[0])]
    rows = rows.assign(name=rows["name"].fillna(_TRUE))
    found: dict[str, list[Rendering]] = {}
    for picture, own in rows.groupby("picture", sort=False):
        for number, (name, each) in enumerate(own.groupby("name", sort=False)):
            rng = np.random.default_rng((output.study.seed, number))
            found.setdefault(str(picture), []).append(Rendering(str(name), _image(str(picture), each, rng)))
    return found


def _image(picture: str, areas: pd.DataFrame, rng: np.random.Generator) -> FloatArray:
    """Every pixel of an area with its own noise."""
    names = list(areas["area"])
    at = _layout(picture, names)
    mean = np.stack(areas["xyz"].to_list())
    spread = np.stack(areas["covariance"].to_list()).reshape(-1, 3, 3)
    values, vectors = np.linalg.eigh(spread)
    roots = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    noise = np.einsum("rcij,rcj->rci", roots[at], rng.standard_normal((*at.shape, 3)))
    return np.asarray((mean[at] + noise) * _WHITE @ _TO_SRGB.T, dtype=float)


def _layout(picture: str, names: list[str]) -> IndexArray:
    """Which area each pixel belongs to, ndarray[rows, columns]."""
    if picture == CHART:
        patches = np.arange(len(names)).reshape(-1, _COLUMNS)
        return np.kron(patches, np.ones((_PATCH_PX, _PATCH_PX), dtype=np.intp))
    return _street({name: at for at, name in enumerate(names)})


def _street(areas: Mapping[str, int]) -> IndexArray:
    """A street at night: a road that narrows toward the horizon, its lines, signals, signs, a car and leaves."""
    height, width = 72, 108
    y, x = np.mgrid[0:height, 0:width]
    found = np.full((height, width), areas["sky"], dtype=np.intp)
    horizon = 30
    found[(y >= horizon - 14) & (y < horizon) & (x < 30)] = areas["wall"]
    found[((x - 92) ** 2 + (1.2 * (y - 22)) ** 2) < 144] = areas["leaves"]
    depth = (y - horizon) / (height - horizon)
    aside = np.abs(x - width / 2)
    road = (y >= horizon) & (aside < 6 + 56 * depth)
    found[(y >= horizon) & ~road] = areas["leaves"]
    found[road] = areas["road"]
    found[road & (np.abs(aside - (4 + 44 * depth)) < 0.6 + 2.4 * depth) & (x > width / 2)] = areas["white line"]
    found[road & (np.abs(aside - (4 + 44 * depth)) < 0.6 + 2.4 * depth) & (x < width / 2)] = areas["yellow line"]
    found[road & (aside < 0.5 + 2.0 * depth) & (y % 12 < 6)] = areas["white line"]
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
    found[42:56, 22:52] = areas["sky"]
    for name, (top, bottom, left, right) in boxes.items():
        found[top:bottom, left:right] = areas[name]
    return found


def draw_renderings(pictures: list[Rendering], title: str) -> Figure:
    """Draw the pictures side by side, in sRGB; what lies outside it is cut off."""
    columns = min(4, len(pictures))
    rows = -(-len(pictures) // columns)
    figure = empty_figure(2.6 * columns, 2.1 * rows + 0.4)
    for number, picture in enumerate(pictures):
        axes = figure.add_subplot(rows, columns, number + 1)
        linear = np.clip(picture.image, 0.0, 1.0)
        encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
        axes.imshow(encoded, interpolation="nearest")
        axes.set_title(picture.name, fontsize=9)
        axes.set_axis_off()
    figure.suptitle(title, fontsize=10)
    return figure


def color_drawings(output: Output) -> Iterator[tuple[str, str, Drawing]]:
    """(file name, caption, drawing) of everything that is drawn of colors."""
    for number, figure in enumerate(error_curves(output), 1):
        caption = f"Color error against noise under {figure.light.upper()}, over how much the color matrix weighs noise"
        yield f"color-noise-{number}", caption, partial(draw_error_curves, figure)
    told = {
        CHART: "A rendering, not a photograph: the chart in daylight through each noise-optimal matrix",
        NIGHT: "A rendering, not a photograph: a street at night under white LEDs, each pixel with the noise of four",
    }
    for number, (picture, seen) in enumerate(renderings(output).items(), 1):
        yield f"rendered-{number}", told[picture], partial(draw_renderings, seen, told[picture])
