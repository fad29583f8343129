"""The spaces of a study: plain CFAs, named designs, sweeps and boxes, with their families and axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..base.errors import Fault, SweepError, faults_of, nearest, unknown
from ..base.types import PerWavelength
from ..base.user_code import Offered, is_in_file, offers
from ..camera.mosaic import Mosaic
from ..camera.sensor import SensorCurves
from ..designs.family import ChoosingFamily, Family, Parameter
from ..designs.plugin import PluginFamily
from ..designs.registry import FAMILIES, PIGMENTS, build_family
from ..designs.space import Filter, Kind, Space
from ..designs.technology import PIGMENT
from ..spectra.builtin.surrogate import parameters_of
from ..spectra.colorants import Colorants
from .schema import BoxSection, DesignSection, Modification, StudySection
from .sensors import check_filter
from .sources import Sources
from .tree import KeyPath
from .user_code import allowed, code_of, is_from_outside

_MOST_POINTS = 2_000_000
_OUT_OF_ORDER_NM = 1e-9
_FAMILIES: Offered = "sweep.families"


def check_cfas(section: StudySection) -> Iterator[Fault]:
    """Check that filters belong to CFAs of the study."""
    for kind, entries in (("designs", section.designs), ("sweeps", section.sweeps), ("boxes", section.boxes)):
        for name, entry in entries.items():
            if entry.cfa not in section.cfas:
                yield unknown((kind, name, "cfa"), "CFA", entry.cfa, section.cfas)


@dataclass(frozen=True)
class SpaceBuilder:
    """Builder of the design spaces of a study; issues go to `sources`."""

    section: StudySection
    sources: Sources
    sensor: SensorCurves
    mosaics: Mapping[str, Mosaic]
    colorants: Colorants | None = None

    def spaces(self) -> list[Space]:
        """Return plain CFAs (those whose every channel has a curve), then named designs, then sweeps."""
        section = self.section
        if not self._fits():
            return []
        entries = (*section.designs.values(), *section.sweeps.values(), *section.boxes.values())
        if section.production.broadening and not any(entry.family in PIGMENTS for entry in entries):
            problem = f"no filter of the study has bands of colorants ({', '.join(PIGMENTS)})"
            self.sources.refuse(Fault(("production", "broadening"), problem))
        changed = {(entry.cfa, channel) for entry in entries for channel in entry.channel}
        # A filter of a wrong CFA or channel has a fault of its own; what it leaves without a curve is none.
        named = all(cfa in self.mosaics and channel in self.mosaics[cfa].channels for cfa, channel in changed)
        spaces = []
        for name, mosaic in self.mosaics.items():
            stated, missing = section.cfas[name].curves, self._without_curve(mosaic)
            for channel in missing:
                if named and name not in {cfa for cfa, _ in changed}:  # else the filter has a fault
                    allowed = (
                        f"a design, sweep or box with `channel: {channel}`; or `curves: {{{channel}: ...}}` of "
                        f"{', '.join(self.sensor.qe)}"
                    )
                    self.sources.refuse(Fault(("cfas", name), f"no curve for channel {channel!r}", None, allowed))
            for channel in stated:
                if channel not in mosaic.channels:
                    self.sources.refuse(unknown(("cfas", name, "curves", channel), "channel", channel, mosaic.channels))
            if not missing:
                spaces.append(Space("reference", name, name))
        for name, design in section.designs.items():
            before, at = len(self.sources.issues), self._at(name, design)
            if len(self.sources.issues) == before:
                axes: dict[str, tuple[float, ...]] = {key: (value,) for key, value in at.items()}
                spaces += self._filtered("design", name, design, axes, ("designs", name, "at"))
        for name, sweep in section.sweeps.items():
            way, listed = "grid" if sweep.grid is not None else "values", len(sweep.listed)
            if sweep.grid is not None or sweep.listed:  # a file that cannot be read has a fault
                spaces += self._filtered("sweep", name, sweep, sweep.axes, ("sweeps", name, way), listed)
        return spaces + self._boxes()

    def _boxes(self) -> list[Space]:
        """Return the boxes that are searched but not swept."""
        wrong, spaces = set[str](), list[Space]()
        for name, box in self.section.boxes.items():
            if box.group in wrong:  # what is wrong with one tile is wrong with all
                continue
            before, axes = len(self.sources.issues), {key: axis.points() for key, axis in box.box.items()}
            spaces += self._filtered("search", name, box, axes, ("boxes", box.group or name, "box"))
            wrong |= {box.group} - {""} if len(self.sources.issues) > before else set()
        return spaces

    def _without_curve(self, mosaic: Mosaic) -> list[str]:
        """Return the channels of a CFA whose curves the sensor does not have."""
        stated = self.section.cfas[mosaic.name].curves
        curves = {c: stated.get(c, self.sensor.curve_name(mosaic.name, c)) for c in mosaic.channels}
        return [channel for channel, curve in curves.items() if curve not in self.sensor.qe]

    def _fits(self) -> bool:
        """Return whether the axes of all grids and boxes can be written out; else add an issue."""
        sweeps, boxes = self.section.sweeps.values(), self.section.boxes.values()
        stated = [*(sweep.grid or {} for sweep in sweeps), *(box.box for box in boxes)]
        total = sum(axis.size for axes in stated for axis in axes.values())
        if total > _MOST_POINTS:
            allowed = f"at most {_MOST_POINTS:,} in all axes together"
            self.sources.refuse(Fault(("sweeps",), "too many values of parameters", f"{total:,}", allowed))
        return total <= _MOST_POINTS

    def _at(self, name: str, design: DesignSection) -> Mapping[str, float]:
        """Return a design's parameters, looked up where it names a built-in filter or a colorant."""
        if not isinstance(design.at, str):
            numbers = {} if self.colorants is None else self.colorants.numbers
            for key, value in design.at.items():
                if isinstance(value, str) and not key.startswith("colorant_"):
                    problem, allowed = "not a number", "a number, without quotes"
                    self.sources.refuse(Fault(("designs", name, "at", key), problem, value, allowed))
                elif isinstance(value, str) and value not in numbers:
                    self.sources.refuse(unknown(("designs", name, "at", key), "colorant", value, numbers))
            return {key: numbers.get(value, 1) if isinstance(value, str) else value for key, value in design.at.items()}
        known = parameters_of(self.section.sensor.builtin).stopbands
        if design.at not in known:
            self.sources.refuse(unknown(("designs", name, "at"), "built-in filter", design.at, known))
            return {}
        return known[design.at].model_dump()

    def _check_channels(self, path: KeyPath, entry: Modification, mosaic: Mosaic | None) -> None:
        """Check that a family replaces channels of the CFA, as many as it wants, each once."""
        channels = [] if mosaic is None else mosaic.channels
        for key, value, known in (("channel", entry.channel, channels), ("base", entry.base, self.sensor.qe)):
            if not value:
                self.sources.refuse(Fault((*path, key), "missing", None, ", ".join(known) or None))
        stated = entry.technology
        absorbs = entry.family in PIGMENTS
        if self.section.production.thickness and not absorbs and stated is not None and stated.interference is None:
            problem = "a pigment has no films that come out too thick (`production.thickness`)"
            self.sources.refuse(Fault((*path, "technology"), problem, PIGMENT, "interference, or nothing stated"))
        wrong = [channel for channel in entry.channel if mosaic is not None and channel not in mosaic.channels]
        for channel in wrong:
            self.sources.refuse(unknown((*path, "channel"), f"channel of {entry.cfa}", channel, channels))
        if (
            mosaic is not None
            and entry.channel
            and not wrong
            and (left := set(self._without_curve(mosaic)) - {*entry.channel})
        ):
            problem = f"{entry.cfa} has no curve for {', '.join(sorted(left))}, which this filter leaves"
            self.sources.refuse(Fault((*path, "channel"), problem, entry.channel, ", ".join(sorted(left))))
        external = is_from_outside(entry.family, _FAMILIES, FAMILIES)
        if external and not allowed(self.sources, (*path, "family"), entry.family):
            return
        if absorbs and stated is not None and stated.interference is not None:
            self.sources.refuse(
                Fault((*path, "technology"), f"{entry.family} is of colorants", stated.description, PIGMENT)
            )
        if external and self.section.production.tolerance:
            self.sources.refuse(
                Fault((*path, "family"), "a family of one's own has no edges that production could shift")
            )
        elif not external and entry.family not in FAMILIES:
            self.sources.refuse(unknown((*path, "family"), "family", entry.family, [*FAMILIES, *offers(_FAMILIES)]))
        elif entry.channel and len(entry.channel) != (
            n_modified := 1 if external else FAMILIES[entry.family].n_modified
        ):
            self.sources.refuse(
                Fault((*path, "channel"), f"{entry.family} replaces {n_modified} channel(s)", entry.channel)
            )
        elif len(set(entry.channel)) < len(entry.channel):
            self.sources.refuse(Fault((*path, "channel"), "a channel is named twice", entry.channel))

    def _filtered(
        self,
        kind: Kind,
        name: str,
        entry: Modification,
        axes: Mapping[str, tuple[float, ...]],
        axes_path: KeyPath,
        listed: int = 0,
    ) -> list[Space]:
        before = len(self.sources.issues)
        path = axes_path[:-1]
        mosaic = self.mosaics.get(entry.cfa)
        for key, curve in (("base", entry.base), ("to", entry.to)):
            if isinstance(curve, str) and curve not in self.sensor.qe:
                self.sources.refuse(unknown((*path, key), "curve", curve, self.sensor.qe))
        self._check_channels(path, entry, mosaic)
        unread = self.section.colorants is not None and self.colorants is None
        if len(self.sources.issues) > before or mosaic is None or unread:  # these have issues of their own
            return []
        assert entry.base is not None  # else there is an issue
        base = self.sensor.curve(entry.base)
        target = self.sensor.curve(entry.to) if isinstance(entry.to, str) else None
        if isinstance(entry.to, float | int):
            target = base * entry.to
        if target is not None and isinstance(entry, BoxSection) and entry.below:
            target = np.minimum(base, target)
        try:
            family = self._family(entry, base, target)
        except SweepError as error:
            self.sources.refuse(*faults_of((*path, "family"), error))
            return []
        usual = family.usual_box(base) if kind == "search" else {}
        ordered = self._axes({**usual, **axes}, axes_path, family.parameters)
        if isinstance(family, ChoosingFamily):
            self._check_numbers(family, ordered, axes_path)
        if len(self.sources.issues) > before:
            return []
        target_name = "" if entry.to is None else str(entry.to)
        candidate = Filter(family, dict.fromkeys(entry.channel, entry.base), target_name, entry.technology)
        space = Space(kind, name, entry.cfa, candidate, tuple(ordered), kind != "search" and not listed, listed)
        self.sources.refuse(*check_filter(space, path, self.sensor), *_check_formed(space, axes_path))
        return [space]

    def _check_numbers(self, family: ChoosingFamily, axes: list[tuple[float, ...]], path: KeyPath) -> None:
        """Check that numbers of a catalog are whole, and in a box from one range for all."""
        numbers = [axes[number] for number, _ in family.slots]
        if any(value != round(value) for axis in numbers for value in axis):
            self.sources.refuse(
                Fault((*path, "colorant_1"), "colorants have whole numbers", None, "a list of them, or a grid")
            )
        if path[-1] == "box" and len({(min(axis), max(axis)) for axis in numbers if axis}) > 1:
            self.sources.refuse(
                Fault((*path, "colorant_2"), "the range is not that of `colorant_1`", None, "one range for all")
            )

    def _family(self, entry: Modification, base: PerWavelength, target: PerWavelength | None) -> Family:
        """Return the family over its curves; raises SweepError."""
        nodes_nm = self.section.wavelengths.nodes_nm
        if not is_from_outside(entry.family, _FAMILIES, FAMILIES):
            catalog = None if self.colorants is None else self.colorants.absorbance
            return build_family(entry.family, nodes_nm, base, target, entry.options, catalog)
        plugin = PluginFamily(code_of(self.sources, entry.family, _FAMILIES), nodes_nm, base, target)
        bounds = f"0 and {entry.base or 1}" if plugin.below_base else "0 and 1"
        whose = "code of that file" if is_in_file(entry.family) else "code of an installed package"
        note = (
            f"{entry.family} runs {whose}: its gradients are differences, and its filters are taken for any "
            f"between {bounds}, which each of them is checked to be"
        )
        if note not in self.sources.warnings:
            self.sources.warnings.append(note)
        return plugin

    def _axes(
        self, axes: Mapping[str, tuple[float, ...]], path: KeyPath, parameters: Sequence[Parameter]
    ) -> list[tuple[float, ...]]:
        """Return the values of each parameter, in order; one not named has its default, or in a box its range."""
        known = [parameter.name for parameter in parameters]
        misspelled = [name for name in axes if name not in known]
        for name in misspelled:
            self.sources.refuse(unknown((*path, name), "parameter", name, known))
        meant = {nearest(name, known) for name in misspelled}
        ordered = []
        for parameter in parameters:
            usual: tuple[float, ...] = () if parameter.default is None else (parameter.default,)
            if path[-1] == "box" and not usual:
                usual = (parameter.low, parameter.high)
            values = axes.get(parameter.name, usual)
            if not values and parameter.name not in meant:
                self.sources.refuse(Fault((*path, parameter.name), "missing"))
            for value in (min(values), max(values)) if values else ():
                if not parameter.low <= value <= parameter.high:
                    allowed = f"{parameter.low:g} to {parameter.high:g}"
                    self.sources.refuse(Fault((*path, parameter.name), "out of range", value, allowed))
                    break
            ordered.append(values)
        return ordered


def _check_formed(space: Space, path: KeyPath) -> Iterator[Fault]:
    """Check that a grid names each value once, and that some filter is well-formed: its edges are in order."""
    twice = {name for name, axis in zip(space.parameters, space.axes, strict=True) if len({*axis}) < len(axis)}
    for name in sorted(twice) if path[-1] == "grid" else ():
        yield Fault((*path, name), "a value twice", None, "different values")
    if space.filter is None or isinstance(space.filter.family, PluginFamily):
        return
    if space.listed:
        beyond = float(space.violation(space.points(0, space.size)).min())
    else:  # the conditions are linear, each least at a corner
        low, high = (np.array([end(axis) for axis in space.axes], dtype=float) for end in (min, max))
        slopes = space.filter.family.violation_gradient(low)
        least = space.filter.family.violation(low[None])[0] + np.minimum(slopes * (high - low), 0.0).sum(axis=1)
        beyond = float(least.max())
    if beyond > _OUT_OF_ORDER_NM:
        which = "is inverted" if space.kind == "design" else "has no filter whose edges are in order"
        problem = f"{space.name} {which}: one edge lies {beyond:.6g} nm behind the next, or more"
        yield Fault(path, problem, None, "left edges before right ones, at both ends of the edges")


def with_listed_designs(section: StudySection, sources: Sources) -> StudySection:
    """Return the study with the designs of sweeps that are in files."""
    sweeps = dict(section.sweeps)
    for name, sweep in section.sweeps.items():
        if isinstance(sweep.values, str):
            designs = sources.designs(("sweeps", name, "values"), sweep.values)
            sweeps[name] = sweep.model_copy(update={"values": designs})
    return section.model_copy(update={"sweeps": sweeps})
