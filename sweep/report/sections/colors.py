"""Color error against noise, over how much the color matrix weighs noise."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from ...results.output import Output
from ..leaders import answering, label
from ..panels import Line, Lines, Panel, Picture
from ..point_panels import Pairs
from ..section import Section
from ..words import digits

_LIGHTS = {"d65": "daylight (D65)", "a": "incandescent light (A)", "led": "white LEDs", "hps": "sodium lamps"}
_MOST_LIGHTS = 2


@dataclass(frozen=True)
class Colors(Section):
    """Mean color error over the SNR of gray of each CFA, by light; `usual`: those of the noise-optimal matrix."""

    curves: Mapping[str, Mapping[str, Pairs]]
    usual: Mapping[str, Mapping[str, tuple[float, float]]]
    hero: str
    rggb: str

    heading = "Color against noise"

    @classmethod
    def of(cls, output: Output) -> Iterator[Section]:
        """Yield it for a study with the task of colors."""
        best = answering(output)
        if output.error_against_noise is None or best is None:
            return
        rows = output.error_against_noise[output.error_against_noise["scenario"] == output.scenarios[0]]
        curves: dict[str, dict[str, Pairs]] = {}
        usual: dict[str, dict[str, tuple[float, float]]] = {}
        for (light, name), curve in rows.groupby(["light", "name"], sort=False):
            where = _LIGHTS.get(str(light), str(light))
            curves.setdefault(where, {})[str(name)] = (
                curve["snr"].to_numpy(dtype=float),
                curve["delta_e_mean"].to_numpy(dtype=float),
            )
            row = curve.iloc[(curve["regularization"] - 1).abs().argmin()]
            usual.setdefault(where, {})[str(name)] = float(row["snr"]), float(row["delta_e_mean"])
        kept = list(curves)[:_MOST_LIGHTS]
        names = list(curves[kept[0]]) if kept else []
        if names:
            yield cls(
                {light: curves[light] for light in kept}, usual, label(best), "RGGB" if "RGGB" in names else names[0]
            )

    @property
    def answer(self) -> list[str]:
        """The error of the usual matrix."""
        light, of = next(iter(self.usual.items()))
        if self.hero not in of or self.rggb not in of:
            return []
        return [
            f"In {light}, with the color matrix that weighs noise as it is, the mean error (CIEDE2000) is {digits(of[self.hero][1])} with "
            f"{self.hero} and {digits(of[self.rggb][1])} with {self.rggb}, at an SNR of gray of {digits(of[self.hero][0])} and {digits(of[self.rggb][0])}."
        ]

    @property
    def picture(self) -> Picture | None:
        """Error over SNR, a panel for each light."""
        panels = list[Panel]()
        for light, curves in self.curves.items():
            lines = {name: Line(*(np.asarray(v)[np.argsort(xy[0])] for v in xy)) for name, xy in curves.items()}
            panels.append(
                Lines(
                    f"mean color error, {light}",
                    "SNR of 18 % gray",
                    lines,
                    self.hero,
                    True,
                    True,
                    marked=False,
                    height=260,
                )
            )
        return Picture(tuple(panels), "Mean color error over the SNR of gray.", "Better: down, right.")
