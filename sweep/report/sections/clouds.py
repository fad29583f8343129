"""The paper's pictures: the chart of all lamps, and what a few CFAs read of them in two channels."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from ...base.types import Array, Float
from ...results.output import Output
from ...results.tables import REFERENCE
from ...spectra.color import display_colors
from ...spectra.spectrum import WavelengthGrid
from ..figures import TYPE_COLORS
from ..leaders import answering, label
from ..look import DIM, INK, Style, font, label_ends
from ..panels import LEFT, Panel, Picture, right_of
from ..section import Section

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Cloud = Mapping[str, tuple[Float[Array, " lamps"], Float[Array, " lamps"]]]


@dataclass(frozen=True)
class Clouds(Section):
    """Digital numbers of all lamps by signal type, of each CFA that `clouds` names in its two channels; the colors."""

    clouds: Mapping[str, Cloud]
    axes: Mapping[str, tuple[str, str]]
    colors: Mapping[str, Float[Array, "lamps 3"]]

    heading = "What the pixels read"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study that names channels."""
        clouds, axes, best = dict[str, Cloud](), dict[str, tuple[str, str]](), answering(output)
        rows = output.named_rows[output.named_rows["scenario"] == output.scenarios[0]]
        for cfa, (x, y) in output.study.clouds.items():
            plain = rows[(rows["kind"] == REFERENCE) & (rows["name"] == cfa)].to_dict("records")
            row = best if best is not None and best["cfa"] == cfa else next(iter(plain), None)
            if row is None:
                continue
            points = output.points[output.points["design_id"] == row["design_id"]]
            if len(points):
                name = label(row)
                clouds[name], axes[name] = _cloud(points, x, y), (x, y)
        if clouds:
            nodes = output.curves.wavelength_nm
            grid = WavelengthGrid(
                start_nm=nodes[0], stop_nm=nodes[-1], step_nm=(nodes[-1] - nodes[0]) / (len(nodes) - 1)
            )
            colors = {kind: display_colors(grid, photons) for kind, photons in output.curves.bundles.items()}
            yield cls(clouds, axes, colors)

    @property
    def picture(self) -> Picture | None:
        """The chart, and a panel for each CFA."""
        clouds: list[Panel] = [
            CloudPanel(f"{name}: {y} / DN", f"{x} / DN", self.clouds[name]) for name, (x, y) in self.axes.items()
        ]
        return Picture(
            (ChartPanel("the chart, a patch per lamp", self.colors), *clouds),
            "The lamps of the chart, and their digital numbers in two channels.",
            "points.parquet has all channels.",
            columns=2,
        )


def _cloud(points: pd.DataFrame, x: str, y: str) -> Cloud:
    """Return the digital numbers in two channels by signal type."""
    read = points.pivot_table(
        index=["signal_type", "signal"], columns="channel", values="dn", sort=False, observed=True
    )
    return {
        str(kind): (of_kind[x].to_numpy(dtype=float), of_kind[y].to_numpy(dtype=float))
        for kind, of_kind in read.groupby(level="signal_type", sort=False, observed=True)
    }


@dataclass(frozen=True)
class CloudPanel:
    """Points of lamps in two channels, in the color of their signal type."""

    title: str
    x_label: str
    cloud: Cloud

    def room(self, *, wide: bool) -> tuple[float, float]:
        """Numbers on the left, names on the right."""
        return LEFT, right_of(self.cloud, wide=wide)

    def tall(self, *, wide: bool) -> float:
        """Lower on a narrow screen."""
        return 250 if wide else 220

    def draw(self, axes: Axes) -> None:
        """Draw points, and each type's name at the height of its middle."""
        size, ends = font(axes.figure), {}  # type: ignore[arg-type]
        for kind, (x, y) in self.cloud.items():
            color = TYPE_COLORS.get(kind, DIM)
            axes.plot(x, y, "o", color=color, markersize=5, alpha=0.8, markeredgecolor="white", markeredgewidth=0.4)
            ends[kind] = float(np.median(y)), Style(color, "-", "o", color), False
        axes.margins(0.08)
        axes.set_xlim(left=0)
        axes.set_ylim(bottom=0)
        label_ends(axes, ends, axes.get_ylim())
        axes.set_xlabel(self.x_label, fontsize=size, color=INK)


@dataclass(frozen=True)
class ChartPanel:
    """A patch of each lamp in its color, as bright as its hue allows; a row for each signal type."""

    title: str
    colors: Mapping[str, Float[Array, "lamps 3"]]

    def room(self, *, wide: bool) -> tuple[float, float]:  # noqa: ARG002
        """Names on the left."""
        return LEFT, 12

    def tall(self, *, wide: bool) -> float:
        """Lower on a narrow screen."""
        return 250 if wide else 180

    def draw(self, axes: Axes) -> None:
        """Draw the patches on black."""
        widest = max(map(len, self.colors.values()))
        patches = np.zeros((len(self.colors), widest, 3))
        for row, colors in enumerate(self.colors.values()):
            patches[row, : len(colors)] = colors
        axes.imshow(patches, aspect="auto", interpolation="nearest", extent=(0, widest, len(self.colors), 0))
        axes.grid(visible=True, color="black", linewidth=3)
        axes.set_axisbelow(False)
        axes.set_xticks(range(widest + 1), labels=[])
        axes.set_yticks(range(len(self.colors) + 1), labels=[])
        size = font(axes.figure)  # type: ignore[arg-type]
        for row, kind in enumerate(self.colors):
            axes.annotate(
                kind, (0, row + 0.5), xytext=(-6, 0), textcoords="offset points", ha="right", va="center", fontsize=size
            )
