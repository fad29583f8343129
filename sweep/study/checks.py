"""Checks of a study across its sections: recognition, columns, memory, and keys of features."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from ..base.errors import Fault, unknown
from ..camera import psf
from ..camera.memory import memory_fault
from ..camera.mosaic import Mosaic
from ..camera.sensor import SensorCurves
from ..camera.setup import Feature
from ..designs.space import Space
from ..features import modules
from ..metrics.quantity import Quantity, RequestedQuantities
from ..metrics.registry import listed
from ..spectra.lights import Lights
from .model import Search, Study
from .schema import StudySection

_MOST_DESIGNS = 10**9


@dataclass(frozen=True)
class Checked:
    """What a feature checks of a study."""

    section: StudySection
    lights: Lights
    mosaics: Mapping[str, Mosaic]
    search: Search | None
    sensor: SensorCurves | None
    spaces: Sequence[Space]
    features: Mapping[str, Feature]


def check_features(checked: Checked) -> Iterator[Fault]:
    """Check the keys of features."""
    for module in modules("section"):
        yield from getattr(module, "faults", lambda _: ())(checked)


def check_scenes(section: StudySection, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check names of channels, the noise of scenes, and that every target forms an image that can be computed."""
    yield from _check_captures(section, mosaics)
    for cfa, channels in section.clouds.items():
        if cfa not in mosaics:
            yield unknown(("clouds", cfa), "CFA", cfa, mosaics)
        for at, channel in enumerate(channels if cfa in mosaics else ()):
            if channel not in mosaics[cfa].channels:
                yield unknown(("clouds", cfa, at), f"channel of {cfa}", channel, mosaics[cfa].channels)
    for name, scene in section.scenarios.items():
        if section.recognition is not None and scene.noise is None:
            problem = "`recognition` needs noise in every scenario"
            yield Fault(("scenarios", name, "noise"), problem, None, "noise: true")
        if scene.pixel is not None:
            for key in ("captures", "companding"):
                if getattr(scene.pixel, key) != getattr(section.pixel, key):
                    problem = "one scenario has no others than the study: a pixel of its own is one of `pixels`"
                    yield Fault(("scenarios", name, "pixel", key), problem, None, "`pixels: {NAME: {captures: ...}}`")
        if (fault := psf.image_fault(scene, scene.pixel_of(section.pixel))) is not None:
            yield fault.under("scenarios", name)


def _check_captures(section: StudySection, mosaics: Mapping[str, Mosaic]) -> Iterator[Fault]:
    """Check that all parts of a study read an HDR pixel, and that its photodiodes have channels of the study."""
    channels = dict.fromkeys(channel for mosaic in mosaics.values() for channel in mosaic.channels)
    for number, capture in enumerate(section.pixel.captures):
        for channel in capture.qe_factor.keys() - channels.keys():
            yield unknown(("pixel", "captures", number, "qe_factor"), "channel", channel, channels)


def check_lights(section: StudySection, lights: Lights, requested: RequestedQuantities) -> Iterator[Fault]:
    """Check keys that name signal types or columns, or that need lamps."""
    yield from _check_columns(requested)
    yield from _check_recognition(section, lights)


def _check_columns(requested: RequestedQuantities) -> Iterator[Fault]:
    """Check that every pair of signal types has columns of its own."""
    by_name: dict[str, Quantity] = {}
    for quantity in listed(replace(requested, edge_shift=False)):
        other = by_name.setdefault(quantity.name, quantity)
        if other.pair != quantity.pair and other.pair is not None and quantity.pair is not None:
            pairs = f"{'/'.join(other.pair)} and {'/'.join(quantity.pair)}"
            problem = f"the pairs {pairs} share the column {quantity.name}"
            yield Fault(("lights",), problem, None, "other names of signal types")


def _check_recognition(section: StudySection, lights: Lights) -> Iterator[Fault]:
    """Check that its states are signal types, each once, and that every scene has noise."""
    recognition = section.recognition
    if recognition is None:
        return
    states = recognition.states or []
    for name in states:
        if name not in lights.classes:
            yield unknown(("recognition", "states"), "signal type", name, lights.classes)
    if len(set(states)) < len(states):
        yield Fault(("recognition", "states"), "a signal type is named twice", states)
    if len(lights.classes) < 2:
        yield Fault(("recognition",), "there is one signal type only", lights.classes[0], "two or more")


def check_size(study: Study) -> Iterator[Fault]:
    """Check that the kernels of every scene and CFA fit into memory."""
    for name in study.scenarios:
        for space in study.spaces:
            if (fault := memory_fault(study.setup(space, name))) is not None:
                problem = f"{fault.problem} (CFA {space.cfa})"
                yield Fault(("scenarios", name, "target"), problem, fault.value, fault.allowed)
                return


def check_count(study: Study) -> Iterator[Fault]:
    """Check that the study has designs, and not too many."""
    if not study.n_designs and study.search is None:
        yield Fault(("cfas",), "no designs", None, "a CFA with a curve for each channel, a design, a sweep or a search")
    if study.n_designs > _MOST_DESIGNS:
        yield Fault(("sweeps",), "too many designs", f"{study.n_designs:,}", f"at most {_MOST_DESIGNS:,}")
