"""Members of a study of several sensors, pixels or light sets, which a feature makes of one file."""

from __future__ import annotations

from typing import NamedTuple

from .schema import StudySection


class SensorAndLights(NamedTuple):
    """One sensor under one set of lights.

    `indices`: their places in the lists of the study; -1 where there is no list. `pixel`: one of several, which is part
    of the sensor's name.
    """

    sensor: str
    lights: str
    indices: tuple[int, int]
    pixel: str = ""

    @property
    def name(self) -> str:
        """Name of its study, and of the folder of its results."""
        return f"{self.sensor} {self.lights}"


class SensorStudies(NamedTuple):
    """A study of several sensors, pixels or light sets: its name and its members."""

    name: str
    members: tuple[SensorAndLights, ...]


def of_one_fit(section: StudySection) -> StudySection:
    """Return the study with lamps of the same fit as its modeled sensor: the figures hold for both together."""
    _, at, fit = (section.sensor.builtin or "").partition("@")
    if not fit or section.lights.builtin != "tl16":
        return section
    lights = section.lights.model_copy(update={"builtin": f"tl16{at}{fit}"})
    return section.model_copy(update={"lights": lights})
